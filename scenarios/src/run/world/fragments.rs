//! What hangs together: by bonds, or by contacts that have held since the start.
//!
//! Fragments that lie on each other touch, and cohesive ones stick wherever they touch; so a fragment is what
//! is joined by contacts of the start that have not opened.

use colluvium_dem::{GrainSample, Partner, Simulation, Snapshot};

/// Grains that hang together.
#[derive(Clone, Debug, PartialEq)]
pub struct Fragment {
    /// Places of its grains in the order of numbers.
    pub grains: Vec<usize>,
    /// Its mass (kg).
    pub mass: f64,
}

/// Pairs of grains that touch now, by their places in the order of numbers, each once and in order.
pub fn touching(simulation: &mut Simulation) -> Vec<[u32; 2]> {
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    pairs(&seen, |_| true)
}

/// Pairs in contact of the grains that `f` takes, by their places in the order of numbers, each once.
fn pairs(seen: &Snapshot, f: impl Fn(&GrainSample) -> bool) -> Vec<[u32; 2]> {
    let place = places(seen);
    let takes = |row: usize| f(&seen.grains[row]);
    let pair = |contact: &colluvium_dem::ContactSample| match contact.partner {
        Partner::Grain(other) if takes(contact.grain) && takes(other) => {
            let (a, b) = (place[contact.grain], place[other]);
            Some([a.min(b), a.max(b)])
        }
        Partner::Grain(_) | Partner::Wall(_) | Partner::Body(_) => None,
    };
    let mut pairs: Vec<[u32; 2]> = seen.contacts.iter().filter_map(pair).collect();
    pairs.sort_unstable();
    pairs
}

/// Largest x of the surfaces of the heaviest heap of free grains that hang together by contacts (m).
pub fn farthest(seen: &Snapshot) -> f64 {
    let mut rows: Vec<usize> = (0..seen.grains.len()).collect();
    rows.sort_by_key(|&i| seen.grains[i].id);
    // Fixed grains join nothing and weigh nothing.
    let weight = |g: &GrainSample| if g.fixed { 0.0 } else { g.mass };
    let masses: Vec<f64> = rows.iter().map(|&i| weight(&seen.grains[i])).collect();
    let heaps = joined(&masses, &pairs(seen, |g| !g.fixed));
    let grains = heaps.first().map_or(&[][..], |heap| &heap.grains);
    let reach = |&k: &usize| seen.grains[rows[k]].position.x + seen.grains[rows[k]].radius;
    grains.iter().map(reach).fold(f64::NEG_INFINITY, f64::max)
}

/// Place of each row of a snapshot in the order of numbers.
fn places(seen: &Snapshot) -> Vec<u32> {
    let mut order: Vec<usize> = (0..seen.grains.len()).collect();
    order.sort_by_key(|&i| seen.grains[i].id);
    let mut place = vec![0; order.len()];
    for (k, i) in order.into_iter().enumerate() {
        place[i] = k as u32;
    }
    place
}

/// Fragments of grains of these masses (kg) joined by pairs, the heaviest first.
pub fn joined(masses: &[f64], pairs: &[[u32; 2]]) -> Vec<Fragment> {
    let mut parent: Vec<usize> = (0..masses.len()).collect();
    fn root(parent: &mut [usize], mut at: usize) -> usize {
        while parent[at] != at {
            parent[at] = parent[parent[at]];
            at = parent[at];
        }
        at
    }
    for &[a, b] in pairs {
        let (a, b) = (root(&mut parent, a as usize), root(&mut parent, b as usize));
        // The lower place becomes the root: the same for any order of pairs.
        parent[a.max(b)] = a.min(b);
    }
    let mut number = vec![usize::MAX; masses.len()];
    let mut list: Vec<Fragment> = Vec::new();
    for (k, mass) in masses.iter().enumerate() {
        let top = root(&mut parent, k);
        if number[top] == usize::MAX {
            number[top] = list.len();
            list.push(Fragment {
                grains: Vec::new(),
                mass: 0.0,
            });
        }
        let fragment = &mut list[number[top]];
        fragment.grains.push(k);
        fragment.mass += mass;
    }
    list.sort_by(|a, b| {
        b.mass
            .total_cmp(&a.mass)
            .then(a.grains[0].cmp(&b.grains[0]))
    });
    list
}

/// For each of so many grains the rank of its fragment, none for single grains.
pub fn ranks(fragments: &[Fragment], grains: usize) -> Vec<Option<usize>> {
    let mut ranks = vec![None; grains];
    for (rank, fragment) in fragments.iter().enumerate() {
        for &grain in fragment.grains.iter().filter(|_| fragment.grains.len() > 1) {
            ranks[grain] = Some(rank);
        }
    }
    ranks
}

/// Ranks of what hangs together by whole bonds.
pub fn by_bonds(simulation: &mut Simulation) -> Vec<Option<usize>> {
    let clusters = simulation.clusters();
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let mut ranks = vec![None; seen.grains.len()];
    for (row, place) in places(&seen).into_iter().enumerate() {
        let cluster = clusters.of[row];
        ranks[place as usize] = (clusters.list[cluster].grains > 1).then_some(cluster);
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_are_one_fragment_and_the_heaviest_comes_first() {
        let masses = [1.0, 1.0, 1.0, 5.0, 2.5, 1.0];
        for pairs in [[[0, 1], [1, 2], [4, 5]], [[4, 5], [1, 2], [0, 1]]] {
            let found = joined(&masses, &pairs);
            let sizes: Vec<usize> = found.iter().map(|f| f.grains.len()).collect();
            assert_eq!(sizes, [1, 2, 3]);
            assert_eq!(found[1].mass, 3.5);
            let ranks = ranks(&found, 6);
            assert_eq!(ranks, [Some(2), Some(2), Some(2), None, Some(1), Some(1)]);
        }
    }
}

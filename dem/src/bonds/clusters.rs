//! What hangs together by bonds and in clumps: boulders.
//!
//! Union–find over the whole bonds. Each grain keeps the way from the root of its cluster to itself, so
//! that clusters across periodic boundaries have one shape.

use crate::domain::Cell;
use crate::grains::{Grains, SPHERE_INERTIA, vector};
use crate::simulation::Simulation;
use nalgebra::Vector3;
use serde::Serialize;

/// Grains held together by bonds or as a clump; a grain alone is a cluster of one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cluster {
    /// Lowest number of its grains.
    pub first: u32,
    /// How many grains.
    pub grains: usize,
    /// How many whole bonds.
    pub bonds: usize,
    /// Mass (kg).
    pub mass: f64,
    /// Volume of its grains (m³).
    pub volume: f64,
    /// Centre of mass, in the box (m).
    pub center: Vector3<f64>,
    /// Velocity of the centre of mass (m/s).
    pub velocity: Vector3<f64>,
    /// Edges of the smallest block along the axes around it, surfaces included (m).
    pub extent: Vector3<f64>,
    /// Radius of gyration about the centre of mass, the grains' own moments included:
    /// `R_g² = Σ m_i (r_i² + 3/5 R_i²)/M` (m).
    pub gyration: f64,
}

impl Cluster {
    /// Diameter of the sphere with the volume of its grains (m).
    pub fn diameter(&self) -> f64 {
        (6.0 / std::f64::consts::PI * self.volume).cbrt()
    }
}

/// All clusters, the heaviest first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Clusters {
    /// The clusters.
    pub list: Vec<Cluster>,
    /// Index into `list` for each grain, in the order of [`crate::Snapshot::grains`].
    pub of: Vec<usize>,
}

impl Clusters {
    /// Clusters of two grains and more: boulders.
    pub fn boulders(&self) -> impl Iterator<Item = &Cluster> {
        self.list.iter().filter(|c| c.grains > 1)
    }

    /// How many clusters are no smaller than each of these, by diameter: steps (m, count), falling.
    pub fn cumulative_sizes(&self) -> Vec<(f64, usize)> {
        let mut sizes: Vec<f64> = self.list.iter().map(Cluster::diameter).collect();
        sizes.sort_by(|a, b| b.total_cmp(a));
        sizes.into_iter().zip(1..).collect()
    }
}

/// Union–find with the way from each node to its parent.
struct Forest {
    parent: Vec<u32>,
    way: Vec<Vector3<f64>>,
}

impl Forest {
    fn new(n: usize) -> Self {
        Forest {
            parent: (0..n as u32).collect(),
            way: vec![Vector3::zeros(); n],
        }
    }

    /// Root of a node and the way from the root to the node.
    fn root(&mut self, node: usize) -> (usize, Vector3<f64>) {
        let (mut top, mut way) = (node, Vector3::zeros());
        while self.parent[top] as usize != top {
            way += self.way[top];
            top = self.parent[top] as usize;
        }
        // Everybody on the way now hangs at the root.
        let (mut at, mut rest) = (node, way);
        while at != top {
            let (next, step) = (self.parent[at] as usize, self.way[at]);
            (self.parent[at], self.way[at]) = (top as u32, rest);
            rest -= step;
            at = next;
        }
        (top, way)
    }

    /// Joins two nodes; `branch` leads from `b` to `a`.
    fn join(&mut self, a: usize, b: usize, branch: Vector3<f64>) {
        let ((ra, wa), (rb, wb)) = (self.root(a), self.root(b));
        // The lower row becomes the root: the same for any order of unions.
        match ra.cmp(&rb) {
            std::cmp::Ordering::Equal => {}
            std::cmp::Ordering::Less => {
                self.parent[rb] = ra as u32;
                self.way[rb] = wa - branch - wb;
            }
            std::cmp::Ordering::Greater => {
                self.parent[ra] = rb as u32;
                self.way[ra] = wb + branch - wa;
            }
        }
    }
}

/// Sums over a cluster while it is gathered; places are from its root.
#[derive(Clone)]
struct Sums {
    cluster: Cluster,
    moment: Vector3<f64>,
    second: f64,
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Sums {
    fn empty() -> Self {
        Sums {
            cluster: Cluster {
                first: u32::MAX,
                grains: 0,
                bonds: 0,
                mass: 0.0,
                volume: 0.0,
                center: Vector3::zeros(),
                velocity: Vector3::zeros(),
                extent: Vector3::zeros(),
                gyration: 0.0,
            },
            moment: Vector3::zeros(),
            second: 0.0,
            low: Vector3::repeat(f64::INFINITY),
            high: Vector3::repeat(f64::NEG_INFINITY),
        }
    }

    fn add(&mut self, grains: &Grains, g: usize, at: &Vector3<f64>, velocity: &Vector3<f64>) {
        let (m, r) = (grains.mass[g], grains.place[g][3]);
        let c = &mut self.cluster;
        c.first = c.first.min(grains.id[g]);
        c.grains += 1;
        c.mass += m;
        c.volume += 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
        c.velocity += m * velocity;
        self.moment += m * at;
        self.second += m * (at.norm_squared() + 1.5 * SPHERE_INERTIA * r * r);
        self.low = self.low.inf(&at.add_scalar(-r));
        self.high = self.high.sup(&at.add_scalar(r));
    }

    fn finish(mut self, root: Vector3<f64>, cell: &Cell) -> Cluster {
        let mass = self.cluster.mass;
        let center = self.moment / mass;
        self.cluster.center = cell.wrap(root + center).0;
        self.cluster.velocity /= mass;
        self.cluster.extent = self.high - self.low;
        let spread = self.second / mass - center.norm_squared();
        self.cluster.gyration = spread.max(0.0).sqrt();
        self.cluster
    }
}

impl Simulation {
    /// What hangs together by whole bonds now, and in clumps.
    pub fn clusters(&mut self) -> Clusters {
        self.observe();
        let (grains, cell) = (&self.grains, self.cell());
        let n = grains.len();
        let mut forest = Forest::new(n);
        for bond in self.bonds.whole() {
            let [i, j] = bond.rows.map(|row| row as usize);
            let apart = vector(&grains.place[i]) - vector(&grains.place[j]);
            forest.join(i, j, cell.nearest(apart).0);
        }
        for [i, j] in self.clumps.chains() {
            let apart = vector(&grains.place[i]) - vector(&grains.place[j]);
            forest.join(i, j, cell.nearest(apart).0);
        }
        let mut sums = vec![Sums::empty(); n];
        let roots: Vec<usize> = (0..n)
            .map(|g| {
                let (root, way) = forest.root(g);
                sums[root].add(grains, g, &way, &self.synchronised(g).0);
                root
            })
            .collect();
        for bond in self.bonds.whole() {
            sums[roots[bond.rows[0] as usize]].cluster.bonds += 1;
        }
        let mut list: Vec<(usize, Cluster)> = (0..n)
            .zip(sums)
            .filter(|(_, s)| s.cluster.grains > 0)
            .map(|(root, s)| (root, s.finish(vector(&grains.place[root]), &cell)))
            .collect();
        list.sort_by(|(_, a), (_, b)| b.mass.total_cmp(&a.mass).then(a.first.cmp(&b.first)));
        let mut number = vec![0; n];
        for (k, (root, _)) in list.iter().enumerate() {
            number[*root] = k;
        }
        Clusters {
            list: list.into_iter().map(|(_, cluster)| cluster).collect(),
            of: roots.into_iter().map(|root| number[root]).collect(),
        }
    }
}

//! What chunks take from each other.
//!
//! A grain that is partner in a pair of an earlier chunk is *shared*. Its sum begins with pairs that
//! another thread evaluates, so its own chunk leaves it, and it is moved after all chunks are through,
//! from copies of the slots of all its pairs in their order: the same sum for any cuts.

use crate::chunk::Chunk;
use rayon::prelude::*;

/// A grain that also takes forces from pairs of earlier chunks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shared {
    /// Number of the grain.
    pub grain: u32,
    /// Its imports: `first_import` up to that of the next one.
    pub first_import: u32,
}

/// A slot that a shared grain takes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Import {
    pub chunk: u32,
    /// Index into the exports of that chunk.
    pub export: u32,
    /// Whether the grain is the pair's `j`.
    pub other: bool,
}

/// The shared grains of a chunk while they are found.
#[derive(Clone, Debug, Default)]
pub(crate) struct Link {
    /// For each grain, its number among the shared ones counted from 1, or 0.
    number: Vec<u32>,
    shared: Vec<Shared>,
    imports: Vec<Import>,
}

/// Tells each chunk which slots its shared grains take, and which slots it must keep for that.
pub(crate) fn link(chunks: &mut [Chunk], links: &mut Vec<Link>, parallel: bool) {
    links.resize(chunks.len(), Link::default());
    if let [chunk] = chunks {
        chunk.exported.clear();
        chunk.shared.clear();
        chunk.imports.clear();
        return;
    }
    each(chunks, links, parallel, |_, chunk, _| {
        chunk.export_crossing()
    });
    each_link(chunks, links, parallel, |c, link, all| link.find(c, all));
    each(chunks, links, parallel, |_, chunk, link| chunk.export(link));
    each_link(chunks, links, parallel, |c, link, all| link.collect(c, all));
    for (chunk, link) in chunks.iter_mut().zip(links) {
        std::mem::swap(&mut chunk.shared, &mut link.shared);
        std::mem::swap(&mut chunk.imports, &mut link.imports);
    }
}

/// Changes every chunk, looking at its own link.
fn each(
    chunks: &mut [Chunk],
    links: &[Link],
    parallel: bool,
    change: impl Fn(usize, &mut Chunk, &Link) + Sync,
) {
    if parallel {
        let both = chunks.par_iter_mut().zip(links.par_iter()).enumerate();
        both.for_each(|(c, (chunk, link))| change(c, chunk, link));
    } else {
        let both = chunks.iter_mut().zip(links).enumerate();
        both.for_each(|(c, (chunk, link))| change(c, chunk, link));
    }
}

/// Changes every link, looking at all chunks.
fn each_link(
    chunks: &[Chunk],
    links: &mut [Link],
    parallel: bool,
    change: impl Fn(usize, &mut Link, &[Chunk]) + Sync,
) {
    if parallel {
        let links = links.par_iter_mut().enumerate();
        links.for_each(|(c, link)| change(c, link, chunks));
    } else {
        let links = links.iter_mut().enumerate();
        links.for_each(|(c, link)| change(c, link, chunks));
    }
}

impl Chunk {
    /// Exports pairs with a partner in a later chunk.
    fn export_crossing(&mut self) {
        self.exported.clear();
        let end = self.grains.end;
        let crossing = |&&place: &&u32| self.j[place as usize] as usize >= end;
        let crossing = self.order.iter().filter(crossing);
        self.exported.extend(crossing);
    }

    /// Exports those, and all pairs of its shared grains.
    fn export(&mut self, link: &Link) {
        if link.shared.is_empty() {
            return;
        }
        self.exported.clear();
        let (start, n) = (self.grains.start, self.grains.len());
        for &place in &self.order {
            let (i, j) = (self.i[place as usize], self.j[place as usize]);
            let (i, j) = (i as usize - start, j as usize - start);
            if j >= n || link.number[i] > 0 || link.number[j] > 0 {
                self.exported.push(place);
            }
        }
    }
}

impl Link {
    /// Finds the grains of chunk `c` that earlier chunks reach.
    fn find(&mut self, c: usize, chunks: &[Chunk]) {
        let grains = &chunks[c].grains;
        self.number.clear();
        self.number.resize(grains.len(), 0);
        for earlier in &chunks[..c] {
            for &place in &earlier.exported {
                let own = (earlier.j[place as usize] as usize).wrapping_sub(grains.start);
                if let Some(number) = self.number.get_mut(own) {
                    *number = 1;
                }
            }
        }
        self.shared.clear();
        for (g, number) in self.number.iter_mut().enumerate() {
            if *number > 0 {
                self.shared.push(Shared {
                    grain: (grains.start + g) as u32,
                    first_import: 0,
                });
                *number = self.shared.len() as u32;
            }
        }
    }

    /// Collects what the shared grains of chunk `c` take, in the order of the pairs.
    fn collect(&mut self, c: usize, chunks: &[Chunk]) {
        let mut total = 0;
        let (number, shared) = (&self.number, &mut self.shared);
        see_imports(number, c, chunks, |s, _| {
            shared[s].first_import += 1;
            total += 1;
        });
        let mut first = 0;
        for shared in shared.iter_mut() {
            first += std::mem::replace(&mut shared.first_import, first);
        }
        self.imports.clear();
        self.imports.resize(total, Import::default());
        let imports = &mut self.imports;
        see_imports(number, c, chunks, |s, import| {
            imports[shared[s].first_import as usize] = import;
            shared[s].first_import += 1;
        });
        // Each beginning stands where the next one's was.
        let mut first = 0;
        for shared in shared {
            std::mem::swap(&mut shared.first_import, &mut first);
        }
    }
}

/// Shows what the shared grains of chunk `c` take, in the order of the pairs: `see(shared, import)`.
fn see_imports(number: &[u32], c: usize, chunks: &[Chunk], mut see: impl FnMut(usize, Import)) {
    let start = chunks[c].grains.start;
    for (chunk, from) in chunks[..=c].iter().enumerate() {
        for (export, &place) in from.exported.iter().enumerate() {
            let (i, j) = (from.i[place as usize], from.j[place as usize]);
            for (grain, other) in [(i, false), (j, true)] {
                let own = (grain as usize).wrapping_sub(start);
                let shared = number.get(own).copied().unwrap_or(0);
                if shared > 0 {
                    see(
                        shared as usize - 1,
                        Import {
                            chunk: chunk as u32,
                            export: export as u32,
                            other,
                        },
                    );
                }
            }
        }
    }
}

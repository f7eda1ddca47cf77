//! How the edges of a zone lie along x: continua and grains take turns.
//!
//! An edge whose continuum lies above it, followed by one whose continuum lies below, share that continuum; in the opposite order they share
//! the grains between them. So a list of edges says all: how many continua there are, and where the grains of each edge end.

use super::{LEAST_CELLS, MaterialEdgeSpec, OverlapError, Side};
use std::ops::Range;

/// Edges of each continuum, along x.
pub(super) fn continua(specs: &[MaterialEdgeSpec]) -> Vec<Range<usize>> {
    let mut all = Vec::new();
    let mut first = 0;
    while first < specs.len() {
        let both = specs[first].side == Side::Above && first + 1 < specs.len();
        let end = first + 1 + usize::from(both);
        all.push(first..end);
        first = end;
    }
    all
}

/// Which edge keeps a continuum that has these: the one that is nearer to where its grid begins.
pub(super) fn keeper(specs: &[MaterialEdgeSpec], edges: &Range<usize>) -> usize {
    let before = |k: usize| specs[k].place - specs[k].wall;
    match before(edges.start) < before(edges.end - 1) {
        true => edges.start,
        false => edges.end - 1,
    }
}

/// Between which places along its own axis each edge has its grains at the start (m): up to the middle of a continuum that it shares, and
/// of the next one that others share.
pub(super) fn grains(specs: &[MaterialEdgeSpec]) -> Vec<[f64; 2]> {
    let continua = continua(specs);
    let middle = |edges: &Range<usize>| {
        let [first, last] = [edges.start, edges.end - 1].map(|k| &specs[k]);
        match edges.len() {
            1 => -first.side.along(f64::INFINITY),
            _ => 0.5 * (first.side.along(first.place) + last.side.along(last.place)),
        }
    };
    let middles: Vec<f64> = continua.iter().map(middle).collect();
    let of = |(n, edges): (usize, &Range<usize>)| {
        let middles = &middles;
        edges.clone().map(move |k| match specs[k].side {
            Side::Below => [
                middles[n],
                middles.get(n + 1).copied().unwrap_or(f64::INFINITY),
            ],
            Side::Above => [
                -middles[n],
                n.checked_sub(1).map_or(f64::INFINITY, |n| -middles[n]),
            ],
        })
    };
    continua.iter().enumerate().flat_map(of).collect()
}

/// Whether edges can be those of one zone.
pub(super) fn check(specs: &[MaterialEdgeSpec]) -> Result<(), OverlapError> {
    let refuse = |key, value, allowed| {
        Err(OverlapError::OutOfRange {
            key,
            value,
            allowed,
        })
    };
    if specs.is_empty() {
        return refuse("edges", 0.0, "at least one");
    }
    for pair in specs.windows(2) {
        let [low, high] = [&pair[0], &pair[1]];
        let apart = high.side.along(high.place) - low.side.along(low.place);
        let (own, other) = (&low.settings, &high.settings);
        if own.exchange_time != other.exchange_time || own.load_time != other.load_time {
            let time = other.exchange_time;
            return refuse(
                "exchange_time",
                time,
                "that of the other edges, as load_time",
            );
        }
        if own.uncoupled != other.uncoupled {
            let value = f64::from(u8::from(other.uncoupled));
            return refuse("uncoupled", value, "that of the other edges");
        }
        match (low.side, high.side) {
            (Side::Below, Side::Above) => {
                if apart <= low.zones()[1] + high.zones()[1] {
                    return refuse("zone", apart, "more than the widths of both overlaps");
                }
            }
            (Side::Above, Side::Below) => {
                if apart < LEAST_CELLS * high.spacing() {
                    return refuse(
                        "continuum",
                        apart,
                        "at least three cells between two edges, the lower one first",
                    );
                }
                for (edge, other) in [(high, low), (low, high)] {
                    let overlaps = apart + other.zones()[1];
                    if (edge.place - edge.back - overlaps).abs() > 1e-9 * overlaps {
                        return refuse(
                            "back",
                            edge.back,
                            "where the overlap at the other end of the continuum ends",
                        );
                    }
                }
            }
            _ => {
                let count = specs.len() as f64;
                return refuse("edges", count, "below and above grains in turn, along x");
            }
        }
    }
    Ok(())
}

//! Where to put an edge between grains and continuum.

use super::Markers;

/// What a run of the continuum alone says about where its material needs grains.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// Start x (m), volume (m²) and misplaced strain of each marker, by x.
    rows: Vec<[f64; 3]>,
}

impl Survey {
    /// Of markers at the end of a run.
    pub fn of(markers: &Markers) -> Self {
        let mut rows: Vec<[f64; 3]> = markers
            .list
            .iter()
            .map(|m| [m.start[0], m.volume, m.total()])
            .collect();
        rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { rows }
    }

    fn volume(&self) -> f64 {
        self.rows.iter().map(|r| r[1]).sum()
    }

    /// Share of all material that lay beyond x at the start: what is grains if the edge is there.
    pub fn share_beyond(&self, x: f64) -> f64 {
        let beyond = self.rows.iter().filter(|r| r[0] > x).map(|r| r[1]);
        beyond.sum::<f64>() / self.volume()
    }

    /// The farthest x (m) such that, of the material between the wall and x, at most a share `forgiven` of *all* material
    /// misplaces more strain than `tolerance`. Zero if the material at the wall does already.
    pub fn edge(&self, tolerance: f64, forgiven: f64) -> f64 {
        let allowed = forgiven * self.volume();
        let mut needy = 0.0;
        let mut edge = 0.0;
        let mut rows = self.rows.as_slice();
        // All markers of a column of cells stand or fall together.
        while let Some(first) = rows.first() {
            let column = rows.partition_point(|r| r[0] <= first[0]);
            let (here, after) = rows.split_at(column);
            needy += here
                .iter()
                .filter(|r| r[2] > tolerance)
                .map(|r| r[1])
                .sum::<f64>();
            if needy > allowed {
                return edge;
            }
            edge = match after.first() {
                Some(next) => 0.5 * (first[0] + next[0]),
                None => first[0],
            };
            rows = after;
        }
        edge
    }

    /// The least tolerance whose edge lies at x (m) or beyond it.
    pub fn tolerance_for(&self, x: f64, forgiven: f64) -> f64 {
        let mut levels: Vec<f64> = self.rows.iter().map(|r| r[2]).collect();
        levels.push(0.0);
        levels.sort_by(f64::total_cmp);
        let at = levels.partition_point(|&t| self.edge(t, forgiven) < x);
        levels.get(at).or(levels.last()).copied().unwrap_or(0.0)
    }

    /// The x (m) beyond which at most a share of all material lay at the start.
    pub fn place_of_share(&self, share: f64) -> f64 {
        let at = self
            .rows
            .partition_point(|r| self.share_beyond(r[0]) > share);
        self.rows.get(at).or(self.rows.last()).map_or(0.0, |r| r[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten columns of two markers; those from x = 6 on misplace as much strain as their x is large.
    fn survey() -> Survey {
        let rows = (0..20).map(|n| {
            let x = f64::from(n / 2) + 0.5;
            [x, 1.0, if x > 6.0 { x } else { 0.0 }]
        });
        Survey {
            rows: rows.collect(),
        }
    }

    #[test]
    fn the_edge_lies_where_the_need_begins() {
        let survey = survey();
        assert_eq!(survey.edge(0.1, 0.0), 6.0);
        assert_eq!(survey.share_beyond(6.0), 0.4);
        assert_eq!(survey.edge(7.0, 0.0), 7.0);
        assert_eq!(survey.edge(0.1, 0.1), 7.0);
        assert_eq!(survey.edge(100.0, 0.0), 9.5);
    }

    #[test]
    fn a_budget_raises_the_tolerance() {
        let survey = survey();
        let place = survey.place_of_share(0.25);
        assert!(survey.share_beyond(place) <= 0.25);
        let tolerance = survey.tolerance_for(place, 0.0);
        assert!(survey.edge(tolerance, 0.0) >= place, "{tolerance}");
        assert_eq!((place, tolerance), (7.5, 7.5));
        assert_eq!(survey.tolerance_for(6.0, 0.0), 0.0);
    }
}

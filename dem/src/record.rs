//! Named arrays: what a checkpoint is made of.

use std::collections::BTreeMap;

/// Arrays by name, bit-exact. How they reach a file is not this crate's business.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Real numbers.
    pub numbers: BTreeMap<String, Vec<f64>>,
    /// Whole numbers.
    pub counts: BTreeMap<String, Vec<u64>>,
}

impl Record {
    /// Takes in another record under `prefix/`.
    pub fn insert(&mut self, prefix: &str, other: Record) {
        for (name, values) in other.numbers {
            self.numbers.insert(format!("{prefix}/{name}"), values);
        }
        for (name, values) in other.counts {
            self.counts.insert(format!("{prefix}/{name}"), values);
        }
    }

    /// The part that was inserted under `prefix/`.
    pub fn extract(&self, prefix: &str) -> Record {
        let cut = |name: &String| {
            name.strip_prefix(prefix)?
                .strip_prefix('/')
                .map(String::from)
        };
        Record {
            numbers: self
                .numbers
                .iter()
                .filter_map(|(n, v)| Some((cut(n)?, v.clone())))
                .collect(),
            counts: self
                .counts
                .iter()
                .filter_map(|(n, v)| Some((cut(n)?, v.clone())))
                .collect(),
        }
    }

    /// The real numbers called `name`, or what is missing.
    pub fn numbers(&self, name: &str) -> Result<&[f64], String> {
        self.numbers
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| format!("array `{name}` is missing"))
    }

    /// The whole numbers called `name`, or what is missing.
    pub fn counts(&self, name: &str) -> Result<&[u64], String> {
        self.counts
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| format!("array `{name}` is missing"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_back_as_they_went_in() {
        let mut part = Record::default();
        part.numbers.insert("x".into(), vec![1.0, -0.0]);
        part.counts.insert("n".into(), vec![3]);
        let mut whole = Record::default();
        whole.insert("grains", part.clone());
        assert_eq!(whole.extract("grains"), part);
        assert_eq!(whole.extract("grain"), Record::default());
        assert!(whole.numbers("x").is_err());
    }
}

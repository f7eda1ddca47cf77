//! A short name for the bits of a state.

use colluvium_dem::StateHash;

/// The hash of the bits of arrays, in hex.
pub fn of(arrays: &[&[f64]]) -> String {
    let mut hash = StateHash::default();
    for value in arrays.iter().flat_map(|a| a.iter()) {
        hash.take(value.to_bits());
    }
    hash.finish()
}

/// The hash of several hashes, each in hex as [`of`] gives it.
pub fn of_hashes<'a>(hashes: impl Iterator<Item = &'a str>) -> String {
    let mut hash = StateHash::default();
    for text in hashes {
        hash.take(u64::from_str_radix(text, 16).unwrap_or_default());
    }
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_changes_the_hash() {
        assert_ne!(of(&[&[1.0, 0.0]]), of(&[&[1.0, -0.0]]));
        // FNV-1a of the empty string is its offset basis.
        assert_eq!(of(&[]), "cbf29ce484222325");
        let pair = [of(&[&[1.0]]), of(&[&[2.0]])];
        let swapped = of_hashes(pair.iter().rev().map(String::as_str));
        assert_ne!(of_hashes(pair.iter().map(String::as_str)), swapped);
    }
}

//! A short name for the bits of a state.

/// 64-bit FNV-1a over the bits of arrays, in hex.
pub fn of(arrays: &[&[f64]]) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for value in arrays.iter().flat_map(|a| a.iter()) {
        for byte in value.to_bits().to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    format!("{hash:016x}")
}

/// The hash of several hashes.
pub fn of_hashes<'a>(hashes: impl Iterator<Item = &'a str>) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in hashes.flat_map(|h| h.bytes()) {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_changes_the_hash() {
        assert_ne!(of(&[&[1.0, 0.0]]), of(&[&[1.0, -0.0]]));
        // FNV-1a of the empty string is its offset basis.
        assert_eq!(of(&[]), "cbf29ce484222325");
    }
}

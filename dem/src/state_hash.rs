//! A hash of state, to tell whether two runs are the same bit for bit.

/// 64-bit FNV-1a over 64-bit words, byte by byte from the lowest.
#[derive(Clone, Copy, Debug)]
pub struct StateHash(u64);

impl Default for StateHash {
    fn default() -> Self {
        StateHash(0xcbf2_9ce4_8422_2325)
    }
}

impl StateHash {
    /// Takes in a word; a float goes in by its bits.
    pub fn take(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// The hash in 16 hex digits.
    pub fn finish(&self) -> String {
        format!("{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_go_in_byte_by_byte_from_the_lowest() {
        let mut hash = StateHash::default();
        hash.take(u64::from(b'a'));
        let mut expected = 0xcbf2_9ce4_8422_2325_u64;
        for byte in [b'a', 0, 0, 0, 0, 0, 0, 0] {
            expected = (expected ^ u64::from(byte)).wrapping_mul(1_099_511_628_211);
        }
        assert_eq!(hash.finish(), format!("{expected:016x}"));
        assert_ne!(hash.finish(), StateHash::default().finish());
    }
}

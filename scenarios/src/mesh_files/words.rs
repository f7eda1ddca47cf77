//! Going through the bytes of a file by words, lines and blocks.

use std::str::FromStr;

/// A place in a file.
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    pub fn new(bytes: &'a [u8]) -> Words<'a> {
        Words { bytes, at: 0 }
    }

    /// Number of the line, from 1.
    pub fn line_number(&self) -> usize {
        1 + self.bytes[..self.at]
            .iter()
            .filter(|&&b| b == b'\n')
            .count()
    }

    /// The next word, or none at the end.
    pub fn word(&mut self) -> Option<&'a str> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &rest[start..];
        let blank = rest.iter().position(|b| b.is_ascii_whitespace());
        let length = blank.unwrap_or(rest.len());
        self.at += start + length;
        // What is no text is no word that anybody knows.
        Some(std::str::from_utf8(&rest[..length]).unwrap_or("\u{fffd}"))
    }

    /// The next word as a number.
    pub fn number<T: FromStr>(&mut self, what: &str) -> Result<T, String> {
        let Some(word) = self.word() else {
            return Err(format!("the file ends where {what} should be"));
        };
        let number = word.parse();
        number.map_err(|_| format!("line {}: `{word}` is not {what}", self.line_number()))
    }

    /// Three numbers.
    pub fn three(&mut self, what: &str) -> Result<[f64; 3], String> {
        Ok([self.number(what)?, self.number(what)?, self.number(what)?])
    }

    /// The rest of the line, without its end.
    pub fn line(&mut self) -> Option<&'a str> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n');
        self.at += end.map_or(rest.len(), |end| end + 1);
        let line = &rest[..end.unwrap_or(rest.len())];
        Some(std::str::from_utf8(line).unwrap_or("\u{fffd}").trim())
    }

    /// The next `count` elements of `size` bytes.
    pub fn block(&mut self, count: usize, size: usize, what: &str) -> Result<&'a [u8], String> {
        let length = count.checked_mul(size);
        let end = length.and_then(|length| self.at.checked_add(length));
        let block = end.and_then(|end| self.bytes.get(self.at..end));
        let block = block.ok_or_else(|| format!("the file ends within {count} {what}"))?;
        self.at += block.len();
        Ok(block)
    }

    /// Goes on behind the next line that reads `word`.
    pub fn skip_to(&mut self, word: &str) -> Result<(), String> {
        while let Some(line) = self.line() {
            if line == word {
                return Ok(());
            }
        }
        Err(format!("the file ends before `{word}`"))
    }
}

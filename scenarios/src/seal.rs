//! The last line of checkpoints and packings: a checksum of all bytes before it.
//!
//! HDF5 passes over what stands behind its end of file, so that the file stays one that every HDF5
//! program opens; but its library is not asked to make sense of damaged bytes.

use crc32fast::Hasher;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

/// What the line begins with; the checksum (CRC-32, 8 hex digits) and a line break follow.
const MARK: &str = "\ncolluvium seal, crc32 ";
/// Bytes of the whole line.
const LENGTH: usize = MARK.len() + 9;

fn line(checksum: u32) -> String {
    format!("{MARK}{checksum:08x}\n")
}

/// Checksum of the first `length` bytes; fails where there are fewer.
fn checksum(file: &mut impl Read, length: u64) -> io::Result<u32> {
    let mut hasher = Hasher::new();
    let mut buffer = vec![0; 1 << 16];
    let mut left = length;
    while left > 0 {
        let part = &mut buffer[..left.min(1 << 16) as usize];
        file.read_exact(part)?;
        hasher.update(part);
        left -= part.len() as u64;
    }
    Ok(hasher.finalize())
}

/// Checksum of a whole file, as 8 hex digits.
pub fn of_file(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    Ok(format!("{:08x}", checksum(&mut file, length)?))
}

/// Adds the line to a finished file.
pub fn close(path: &Path) -> io::Result<()> {
    let mut file = OpenOptions::new().read(true).append(true).open(path)?;
    let length = file.metadata()?.len();
    let sum = checksum(&mut file, length)?;
    file.write_all(line(sum).as_bytes())
}

/// Says what is wrong with a file that does not end in the line of its bytes.
pub fn check(path: &Path) -> Result<(), String> {
    let unreadable = |error: io::Error| format!("it cannot be read ({error})");
    let mut file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let Some(held) = length.checked_sub(LENGTH as u64) else {
        return Err("damaged: it was cut off".into());
    };
    let sum = checksum(&mut file, held).map_err(unreadable)?;
    let mut end = String::new();
    let found = file.read_to_string(&mut end);
    if found.is_err() || !end.starts_with(MARK) {
        return Err(
            "damaged or not a file of this program: it was cut off, or does not end in its checksum"
                .into(),
        );
    }
    if end != line(sum) {
        return Err("damaged: its checksum is that of other bytes".into());
    }
    Ok(())
}

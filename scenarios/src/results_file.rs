//! `results.h5`: every table of a run, with units.

use crate::failure::Failure;
use crate::table::Table;
use hdf5::types::VarLenUnicode;
use std::path::Path;

/// Writes tables as groups of one-dimensional datasets, each with the attribute `unit`.
///
/// The file is written under a temporary name and renamed when it is whole.
pub fn write(path: &Path, scene: &str, tables: &[&Table]) -> Result<(), Failure> {
    let partial = path.with_extension("h5.partial");
    let done = write_tables(&partial, scene, tables)
        .map_err(|error| reason(&error))
        .and_then(|()| put_in_place(&partial, path).map_err(|error| error.to_string()));
    done.map_err(|error| {
        let _ = std::fs::remove_file(&partial);
        Failure::Run(format!("cannot write {}: {error}", path.display()))
    })
}

fn write_tables(path: &Path, scene: &str, tables: &[&Table]) -> hdf5::Result<()> {
    let file = hdf5::File::create(path)?;
    attribute(&file, "format", "colluvium results 1")?;
    attribute(&file, "version", env!("CARGO_PKG_VERSION"))?;
    attribute(&file, "scene", scene)?;
    for table in tables {
        let group = file.create_group(&table.name)?;
        for column in &table.columns {
            let dataset = if column.values.len() > 64 {
                group
                    .new_dataset_builder()
                    .shuffle()
                    .deflate(4)
                    .with_data(&column.values)
                    .create(column.name.as_str())?
            } else {
                group
                    .new_dataset_builder()
                    .with_data(&column.values)
                    .create(column.name.as_str())?
            };
            attribute(&dataset, "unit", &column.unit)?;
        }
    }
    file.flush()
}

/// Writes a text attribute.
pub fn attribute(at: &hdf5::Location, name: &str, text: &str) -> hdf5::Result<()> {
    let value: VarLenUnicode = text
        .parse()
        .map_err(|_| hdf5::Error::Internal(format!("attribute {name} holds a NUL character")))?;
    at.new_attr::<VarLenUnicode>()
        .create(name)?
        .write_scalar(&value)
}

/// Reads a text attribute.
pub fn read_attribute(at: &hdf5::Location, name: &str) -> hdf5::Result<String> {
    Ok(at
        .attr(name)?
        .read_scalar::<VarLenUnicode>()?
        .as_str()
        .to_owned())
}

/// What went wrong with a file, in one line: the system's reason where HDF5 passes one on.
pub fn reason(error: &hdf5::Error) -> String {
    let text = error.to_string();
    let system = text
        .split_once("error message = '")
        .and_then(|(_, rest)| rest.split_once('\''));
    match system {
        Some((reason, _)) => reason.to_owned(),
        None => text.lines().next().unwrap_or_default().to_owned(),
    }
}

/// Flushes a finished file to the disk and gives it its name, for good: the folder is flushed too.
pub fn put_in_place(partial: &Path, path: &Path) -> std::io::Result<()> {
    std::fs::File::open(partial)?.sync_all()?;
    std::fs::rename(partial, path)?;
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    let folder = std::fs::File::open(folder.unwrap_or(Path::new(".")))?;
    // Not every file system can flush a folder.
    let _ = folder.sync_all();
    Ok(())
}

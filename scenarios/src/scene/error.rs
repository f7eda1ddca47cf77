//! What can be wrong with a scene.

use thiserror::Error;

/// A scene that cannot be used; each message names the file, the key and what is allowed.
#[derive(Debug, Error)]
pub enum SceneError {
    /// Neither a bundled scene nor a readable file.
    #[error(
        "{name}: cannot read this scene file ({source}), and no bundled scene has this name{}; bundled: {names}",
        hint(.nearest)
    )]
    Missing {
        /// What was asked for.
        name: String,
        /// The bundled name nearest to it.
        nearest: Option<String>,
        /// All bundled names.
        names: String,
        /// Why the file could not be read.
        source: std::io::Error,
    },
    /// Not TOML.
    #[error("{file}: {message}")]
    Unreadable {
        /// Where it was read.
        file: String,
        /// What the reader says.
        message: String,
    },
    /// A key that does not exist.
    #[error("{file}: unknown key `{key}`{}; known here: {known}", hint(.nearest))]
    UnknownKey {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// The known key nearest to it.
        nearest: Option<String>,
        /// The keys of the same table.
        known: String,
    },
    /// A key that has to be there.
    #[error("{file}: key `{key}` is missing; wanted: {wanted}")]
    MissingKey {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// What belongs there.
        wanted: String,
    },
    /// A value of the wrong type.
    #[error("{file}: key `{key}` = {value} has the wrong type ({found}); wanted: {wanted}")]
    WrongType {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// The value as written.
        value: String,
        /// Its type.
        found: String,
        /// The type and range that belong there.
        wanted: String,
    },
    /// A value outside its range.
    #[error("{file}: key `{key}` = {value} is not allowed; allowed: {range}")]
    OutOfRange {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// The value as written.
        value: String,
        /// The allowed range.
        range: String,
    },
    /// Keys of which only one may be given.
    #[error("{file}: keys `{first}` and `{second}` exclude each other; give one of them")]
    Conflict {
        /// Where it was read.
        file: String,
        /// One dotted path.
        first: String,
        /// The other.
        second: String,
    },
    /// Parts of a contact law that do not go together.
    #[error(
        "{file}: key `{key}` = \"{value}\" does not go with the other parts of the contact law: {reason}"
    )]
    Composition {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// The part's name.
        value: String,
        /// Why the engine refuses it.
        reason: String,
    },
    /// A key that the chosen law does not read.
    #[error("{file}: key `{key}` = {value} is not read by this law: {law}")]
    Unread {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// The value as written.
        value: String,
        /// The parts of the law, and the keys it reads.
        law: String,
    },
    /// A key that a choice does not read.
    #[error("{file}: key `{key}` is not read by {choice}; leave it out")]
    Unneeded {
        /// Where it was read.
        file: String,
        /// Dotted path.
        key: String,
        /// The choice that does not read it.
        choice: String,
    },
    /// A start file that cannot be used.
    #[error("key `start` = \"{path}\": {message}")]
    Start {
        /// The path as written.
        path: String,
        /// What is wrong with it, and what is allowed.
        message: String,
    },
    /// A setting that is not of the form `KEY=VALUE`.
    #[error("{option} {text}: wanted KEY=VALUE, as in `{option} slope_degrees=25`")]
    Setting {
        /// The option it came by.
        option: String,
        /// The setting as written.
        text: String,
    },
    /// A rheology file that cannot be read.
    #[error("key `rheology.file` = \"{path}\": {message}")]
    Rheology {
        /// The path as written.
        path: String,
        /// What is wrong with it, naming key, value and range where there is one.
        message: String,
    },
}

fn hint(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map(|n| format!(" (did you mean `{n}`?)"))
        .unwrap_or_default()
}

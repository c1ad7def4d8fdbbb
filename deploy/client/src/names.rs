//! Names of networks and components, which become names of files.

use crate::error::Error;

/// The prefix of files of rcdeploy itself.
const RESERVED: &str = "rcdeploy";

/// Whether a name is reserved for files of rcdeploy itself.
pub fn is_reserved(name: &str) -> bool {
    let rest = name.strip_prefix(RESERVED);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

/// Checks a name. Names become files in folders that are removed as a whole, so a name must not
/// lead elsewhere.
pub fn check_name(kind: &str, name: &str) -> Result<(), Error> {
    let fine = !name.is_empty()
        && name.len() <= 64
        && !name.starts_with(['.', '-'])
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'));
    if !fine {
        return Err(Error::Plan(format!(
            "`{name}` cannot be the name of a {kind}: up to 64 letters, digits, `_`, `-` and `.`, the first no `.` or `-`"
        )));
    }
    if is_reserved(name) {
        return Err(Error::Plan(format!(
            "the name {name} is reserved; choose another one for the {kind}"
        )));
    }
    Ok(())
}

//! Which names networks and components may have: they become names of files.

use crate::error::Error;

/// How the names begin that files of rcdeploy itself have beside those of the components.
const RESERVED: &str = "rcdeploy";

/// Whether files of rcdeploy itself have this name.
pub fn is_reserved(name: &str) -> bool {
    let rest = name.strip_prefix(RESERVED);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

/// Names become files in folders that are removed as a whole: nothing that leads elsewhere is let through.
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

//! Addresses: the names at which the ends of a connection meet.

/// The longest address in bytes. Longer names do not fit into names of services.
pub const LONGEST: usize = 200;

/// Checks the form of an address, such as `patrol/simulator/Laser`. The error says what is allowed.
///
/// ```
/// assert!(rc_vocabulary::address::check("patrol/simulator/Laser").is_ok());
/// assert!(rc_vocabulary::address::check("/Laser").is_err());
/// ```
pub fn check(text: &str) -> Result<(), String> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if text.len() > LONGEST {
        return Err(format!("an address has at most {LONGEST} characters"));
    }
    if text
        .split('/')
        .any(|part| part.is_empty() || !part.chars().all(allowed))
    {
        return Err(format!(
            "`{text}` is not an address: names of letters, digits, `_` and `-`, joined by `/`, as in `default/Laser`"
        ));
    }
    Ok(())
}

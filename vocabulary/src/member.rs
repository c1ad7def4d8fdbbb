//! Members of slot arrays: their names, and how many there may be.

/// The longest name of a member in bytes.
pub const LONGEST: usize = 64;
/// The most members of an array. Each has ports of its own: descriptors, queues, names.
pub const MOST: usize = 128;

/// Checks the name of a member. All middlewares use it unchanged, so no two members get the same
/// name there. The error says what is allowed.
///
/// ```
/// assert!(rc_vocabulary::member::check("front_left").is_ok());
/// assert!(rc_vocabulary::member::check("front.left").is_err());
/// ```
pub fn check(name: &str) -> Result<(), String> {
    let fits = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !name.contains("__")
        && !name.ends_with('_');
    if !fits {
        let allowed = "a letter, then letters, digits and single `_`, none at the end";
        return Err(format!("the name of a member has {allowed}"));
    }
    if name.len() > LONGEST {
        let length = name.len();
        return Err(format!(
            "the name of a member has at most {LONGEST} bytes, and this one has {length}"
        ));
    }
    Ok(())
}

/// The name of a member outside of its component: `lasers.front`.
pub fn path(array: &str, member: &str) -> String {
    format!("{array}.{member}")
}

/// The array and the member of such a name.
pub fn split(path: &str) -> Option<(&str, &str)> {
    path.split_once('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_members_are_names_in_every_middleware() {
        let longest = "a".repeat(LONGEST);
        for name in ["front", "a", "L2_front", longest.as_str()] {
            assert_eq!(check(name), Ok(()), "{name}");
            // ROS 2 is the strictest: it replaces what it does not allow.
            assert_eq!(crate::ros::name(name), format!("/{name}"));
        }
        let too_long = format!("{longest}a");
        for name in [
            "", "_a", "2a", "a__b", "a_", "a.b", "a-b", "a b", "a/b", "ä", &too_long,
        ] {
            assert!(check(name).is_err(), "{name}");
        }
        assert_eq!(split(&path("lasers", "front")), Some(("lasers", "front")));
    }
}

//! Names that a user writes: any end of a name that means one thing is enough.

use crate::error::Error;
use rc_diagnostics::foreign::clean;
use rc_diagnostics::nearest;

/// The parts of a name: dots and slashes separate them.
fn parts(name: &str) -> Vec<&str> {
    name.split(['.', '/']).collect()
}

/// Whether `name` ends with the parts of `end`.
fn ends_with(name: &str, end: &str) -> bool {
    let (name, end) = (parts(name), parts(end));
    name.ends_with(&end)
}

/// Finds what `wanted` means. Each item has several names; the first one is shown.
pub(crate) fn find<'i, T>(
    network: &str,
    what: &'static str,
    wanted: &str,
    items: &'i [T],
    names: impl Fn(&T) -> Vec<String>,
) -> Result<&'i T, Error> {
    let named: Vec<(&T, Vec<String>)> = items.iter().map(|item| (item, names(item))).collect();
    let exact: Vec<&(&T, Vec<String>)> = named
        .iter()
        .filter(|(_, names)| names.iter().any(|name| name == wanted))
        .collect();
    let ending: Vec<&(&T, Vec<String>)> = named
        .iter()
        .filter(|(_, names)| names.iter().any(|name| ends_with(name, wanted)))
        .collect();
    let found = if exact.is_empty() { ending } else { exact };
    match found.as_slice() {
        [(one, _)] => Ok(one),
        [] => Err(Error::Unknown {
            network: network.to_owned(),
            what,
            name: clean(wanted),
            help: nearest_of(wanted, named.iter().flat_map(|(_, names)| names)),
        }),
        many => Err(Error::Ambiguous {
            name: clean(wanted),
            found: many
                .iter()
                .filter_map(|(_, names)| Some(format!("`{}`", names.first()?)))
                .collect(),
        }),
    }
}

/// The help for an unknown name: the nearest name, or all names.
pub fn nearest_of<'n>(wanted: &str, names: impl Iterator<Item = &'n String>) -> String {
    let names: Vec<&str> = names.map(String::as_str).collect();
    let count = parts(wanted).len();
    // A short name is compared with ends that are as short.
    let ends: Vec<String> = names
        .iter()
        .map(|name| {
            let parts = parts(name);
            parts[parts.len().saturating_sub(count)..].join(".")
        })
        .collect();
    let dotted = wanted.replace('/', ".");
    let near = nearest(&dotted, ends.iter().map(String::as_str));
    if let Some(at) = near.and_then(|near| ends.iter().position(|end| end == near)) {
        return format!("; did you mean `{}`?", names[at]);
    }
    match names.as_slice() {
        [] => "; there is none".to_owned(),
        few if few.len() <= 12 => format!("; there are: {}", few.join(", ")),
        many => format!("; `rcdeploy list` shows the {} names", many.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_end_of_a_name_that_means_one_thing_is_enough() {
        let items = ["a.Laser.scan", "b.Laser.scan", "a.Poses.newPose"];
        let find = |wanted: &str| {
            let names = |item: &&str| {
                vec![
                    (*item).to_owned(),
                    format!("net/{}", item.replace('.', "/")),
                ]
            };
            find("net", "topic", wanted, &items, names)
                .copied()
                .map_err(|e| e.to_string())
        };
        assert_eq!(find("newPose").as_deref(), Ok("a.Poses.newPose"));
        assert_eq!(find("a.Laser.scan").as_deref(), Ok("a.Laser.scan"));
        assert_eq!(find("net/b/Laser/scan").as_deref(), Ok("b.Laser.scan"));
        assert_eq!(
            find("scan").as_deref(),
            Err(
                &"`scan` can be `a.Laser.scan`, or `b.Laser.scan`; write more of the name"
                    .to_owned()
            )
        );
        let unknown = find("newPos").expect_err("unknown");
        assert_eq!(
            unknown,
            "net has no topic `newPos`; did you mean `a.Poses.newPose`?"
        );
        let unknown = find("wheel").expect_err("unknown");
        assert!(unknown.contains("there are: a.Laser.scan"), "{unknown}");
    }
}

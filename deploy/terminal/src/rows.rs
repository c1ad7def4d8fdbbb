//! The rows of the table: components, and the groups that their dotted names make.

use std::collections::BTreeSet;

/// One row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Row<'n> {
    /// The whole name of the component or of the group.
    pub(crate) path: &'n str,
    /// The last part of it.
    pub(crate) label: &'n str,
    /// How many groups it is in.
    pub(crate) depth: usize,
    pub(crate) kind: Kind,
    /// The component itself, or all that are in the group.
    pub(crate) members: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Component,
    Group { folded: bool },
}

/// The rows of components with these names. The components of a group are below it, at
/// the place of the first one.
pub(crate) fn rows<'n>(
    names: impl IntoIterator<Item = &'n str>,
    folded: &BTreeSet<String>,
) -> Vec<Row<'n>> {
    let names: Vec<(usize, &str)> = names.into_iter().enumerate().collect();
    let mut rows = Vec::new();
    level(&names, 0, 0, folded, &mut rows);
    rows
}

/// The rows of names that are equal up to the byte `from`.
fn level<'n>(
    names: &[(usize, &'n str)],
    from: usize,
    depth: usize,
    folded: &BTreeSet<String>,
    rows: &mut Vec<Row<'n>>,
) {
    let mut seen: BTreeSet<&str> = BTreeSet::new();
    for &(at, name) in names {
        let rest = &name[from..];
        let Some((label, _)) = rest.split_once('.') else {
            rows.push(Row {
                path: name,
                label: rest,
                depth,
                kind: Kind::Component,
                members: vec![at],
            });
            continue;
        };
        if !seen.insert(label) {
            continue;
        }
        let end = from + label.len();
        let path = &name[..end];
        let inside = |name: &str| {
            name[from..]
                .strip_prefix(label)
                .is_some_and(|r| r.starts_with('.'))
        };
        let members: Vec<(usize, &str)> =
            names.iter().copied().filter(|(_, n)| inside(n)).collect();
        let is_folded = folded.contains(path);
        rows.push(Row {
            path,
            label,
            depth,
            kind: Kind::Group { folded: is_folded },
            members: members.iter().map(|(at, _)| *at).collect(),
        });
        if !is_folded {
            level(&members, end + 1, depth + 1, folded, rows);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(names: &[&str], folded: &[&str]) -> Vec<String> {
        let folded = folded.iter().map(|&f| f.to_owned()).collect();
        rows(names.iter().copied(), &folded)
            .iter()
            .map(|row| {
                let mark = match row.kind {
                    Kind::Component => "",
                    Kind::Group { folded: true } => "+",
                    Kind::Group { folded: false } => "-",
                };
                format!(
                    "{}{mark}{} {:?}",
                    "  ".repeat(row.depth),
                    row.label,
                    row.members
                )
            })
            .collect()
    }

    #[test]
    fn members_of_a_group_are_below_it() {
        let names = ["base", "left.arm.hand", "right.eye", "left.eye", "lefty"];
        assert_eq!(
            shown(&names, &[]),
            [
                "base [0]",
                "-left [1, 3]",
                "  -arm [1]",
                "    hand [1]",
                "  eye [3]",
                "-right [2]",
                "  eye [2]",
                "lefty [4]"
            ]
        );
        assert_eq!(
            shown(&names, &["left", "left.arm", "right"]),
            ["base [0]", "+left [1, 3]", "+right [2]", "lefty [4]"]
        );
    }
}

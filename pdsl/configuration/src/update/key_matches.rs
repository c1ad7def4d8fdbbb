//! Matches the keys of a table with parameters, including renamed ones.

use crate::document::Locator;
use crate::model::{Kind, Parameter};
use crate::parameters::is_valid_value;
use rc_diagnostics::nearest;
use std::collections::{HashMap, HashSet};
use toml_edit::{Item, TableLike};

/// The number of pairs of names beyond which names are not compared.
const PAIRS: usize = 100_000;
/// The number of candidates in a message.
const NAMED: usize = 3;

/// The keys of one table, matched with its parameters.
pub(super) struct KeyMatches<'m> {
    known: HashSet<&'m str>,
    /// The parameters without a key.
    absent: Vec<&'m Parameter>,
    /// Keys with another spelling, and the parameters that they mean.
    renamed: HashMap<String, &'m Parameter>,
    /// For each other key, parameters that it may mean and whose defaults would apply.
    candidates: HashMap<String, Vec<&'m Parameter>>,
    /// All those parameters.
    ambiguous: HashSet<&'m str>,
    /// Whether there are too many names to compare.
    many: bool,
}

impl<'m> KeyMatches<'m> {
    pub(super) fn of(parameters: &'m [Parameter], table: &dyn TableLike, locator: Locator) -> Self {
        let known: HashSet<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
        let absent: Vec<&Parameter> = parameters
            .iter()
            .filter(|p| !table.contains_key(&p.name))
            .collect();
        let unknown: Vec<_> = table.iter().filter(|(n, _)| !known.contains(n)).collect();
        let many = unknown.len() * absent.len() > PAIRS;
        let mut pairs = Vec::new();
        for (name, item) in unknown.iter().filter(|_| !many) {
            let same = absent.iter().filter(|p| is_misspelling(name, &p.name));
            let fitting = same.filter(|p| is_valid_value(p, item, locator));
            pairs.extend(fitting.map(|p| ((*name).to_owned(), *p)));
        }
        let alone = |(name, parameter): &&(String, &Parameter)| {
            let rivals = pairs
                .iter()
                .filter(|(n, p)| n == name || p.name == parameter.name);
            rivals.count() == 1
        };
        let renamed: HashMap<String, &Parameter> = pairs.iter().filter(alone).cloned().collect();
        let taken: HashSet<&str> = renamed.values().map(|p| p.name.as_str()).collect();
        let free = absent
            .iter()
            .filter(|p| !p.is_required() && !taken.contains(p.name.as_str()));
        let free: Vec<&Parameter> = free.copied().collect();
        let (mut candidates, mut ambiguous) = (HashMap::new(), HashSet::new());
        for (name, item) in unknown {
            if renamed.contains_key(name) {
                continue;
            }
            let near = nearest(name, free.iter().filter(|_| !many).map(|p| p.name.as_str()));
            let may_mean = |p: &&&Parameter| many || may_mean(p, name, item, locator);
            let mut all: Vec<&Parameter> = Vec::new();
            for parameter in free.iter().filter(may_mean) {
                ambiguous.insert(parameter.name.as_str());
                if near == Some(parameter.name.as_str()) {
                    all.insert(0, parameter);
                } else if all.len() < NAMED {
                    all.push(parameter);
                } else if many {
                    break;
                }
            }
            if !all.is_empty() {
                candidates.insert(name.to_owned(), all);
            }
        }
        if many {
            ambiguous.extend(free.iter().map(|p| p.name.as_str()));
        }
        Self {
            known,
            absent,
            renamed,
            candidates,
            ambiguous,
            many,
        }
    }

    /// Whether the key is a parameter.
    pub(super) fn is_parameter(&self, key: &str) -> bool {
        self.known.contains(key)
    }

    /// The parameter that the key certainly means, under another spelling.
    pub(super) fn renamed(&self, key: &str) -> Option<&'m Parameter> {
        self.renamed.get(key).copied()
    }

    /// The parameters that the key may mean. A person has to decide.
    pub(super) fn candidates(&self, key: &str) -> &[&'m Parameter] {
        self.candidates.get(key).map_or(&[], Vec::as_slice)
    }

    /// Whether no key may mean this parameter.
    pub(super) fn is_unambiguous(&self, parameter: &Parameter) -> bool {
        !self.ambiguous.contains(parameter.name.as_str())
    }

    /// The parameter with the nearest name.
    pub(super) fn nearest(&self, key: &str) -> Option<&'m str> {
        let absent = self.absent.iter().filter(|_| !self.many);
        nearest(key, absent.map(|p| p.name.as_str()))
    }
}

/// Whether `key` with the value `item` may mean `parameter`. It may mean a group if a name in it
/// is equal, or if the value may have moved into the group.
fn may_mean(parameter: &Parameter, key: &str, item: &Item, locator: Locator) -> bool {
    let Kind::Group(members) = &parameter.kind else {
        return is_valid_value(parameter, item, locator);
    };
    members.iter().any(|member| match item.as_table_like() {
        Some(table) => table.contains_key(&member.name),
        None => member.name == key && is_valid_value(member, item, locator),
    })
}

/// Whether two names are the same in another spelling, or differ by one added or missing letter
/// or by two swapped letters. A different letter or digit makes another name (`min_x` and
/// `min_y`, `motor1` and `motor`). Short names must be equal.
fn is_misspelling(a: &str, b: &str) -> bool {
    let plain = |name: &str| -> Vec<char> {
        let letters = name.chars().filter(|c| *c != '_' && *c != '-');
        letters.flat_map(char::to_lowercase).collect()
    };
    let (a, b) = (plain(a), plain(b));
    if a == b {
        return true;
    }
    let (long, short) = if a.len() < b.len() { (b, a) } else { (a, b) };
    if short.len() < 4 {
        return false;
    }
    let differ = |(x, y): (&char, &char)| x != y;
    let Some(at) = long
        .iter()
        .zip(&short)
        .position(differ)
        .or(Some(short.len()))
    else {
        return false;
    };
    if long.len() == short.len() {
        let swapped = at + 1 < long.len() && long[at] == short[at + 1] && long[at + 1] == short[at];
        return swapped && long[at + 2..] == short[at + 2..] && long[at].is_alphabetic();
    }
    long.len() == short.len() + 1 && long[at + 1..] == short[at..] && long[at].is_alphabetic()
}

#[cfg(test)]
mod tests {
    use super::is_misspelling;

    #[test]
    fn spellings_and_slips_are_one_name_and_other_words_are_not() {
        for (a, b) in [
            ("maxSpeed", "max_speed"),
            ("max-Speed", "Max_Speed"),
            ("speeds", "speed"),
            ("saef_distance", "safe_distance"),
            ("tolerace", "tolerance"),
            ("x", "X"),
        ] {
            assert!(is_misspelling(a, b) && is_misspelling(b, a), "{a} {b}");
        }
        for (a, b) in [
            ("min_speed", "max_speed"),
            ("left_x", "left_y"),
            ("motor", "motor1"),
            ("motor12", "motor21"),
            ("kp", "ki"),
            ("kp", "kpi"),
            ("speed", "velocity"),
            ("speed", "sp"),
        ] {
            assert!(!is_misspelling(a, b) && !is_misspelling(b, a), "{a} {b}");
        }
    }
}

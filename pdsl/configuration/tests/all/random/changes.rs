//! Single changes of random parameters at run time, and saving them.

use super::{Kind, Line, PERIOD, check, fill, made};
use arbtest::arbitrary::{Result, Unstructured};
use arbtest::arbtest;
use rc_configuration::model::Parameters;
use rc_configuration::{Configuration, LiveParameters, SaveError};
use rc_diagnostics::{SourceMap, render};
use rc_vocabulary::ParameterStatus;
use serde_json::{Value as Json, json};
use std::collections::HashMap;
use std::path::Path;

/// The numbers of changes tried.
#[derive(Default)]
struct Count {
    accepted: usize,
    refused: usize,
    /// Accepted changes of parameters that the file did not contain.
    added: usize,
    /// Accepted values that are NaN or infinite.
    nan: usize,
}

/// A random value of the type that `allowed` begins with. It may be outside the limits.
fn value(u: &mut Unstructured<'_>, allowed: &str) -> Result<Json> {
    let word: String = allowed
        .chars()
        .take_while(char::is_ascii_lowercase)
        .collect();
    let one = |u: &mut Unstructured<'_>| -> Result<Json> {
        let values = match word.as_str() {
            "bool" => vec![json!(true), json!(false)],
            "int" | "long" => [-10, -9, -7, 0, 7, 8, 9, 11, 15, 19, 25, 1 << 40]
                .map(|int: i64| json!(int))
                .into(),
            "float" | "double" => vec![
                json!(0.5),
                json!(1),
                json!(0),
                json!(-0.0),
                json!(12.25),
                json!(1e40),
                json!("nan"),
                json!("inf"),
                json!("-inf"),
            ],
            "duration" => vec![
                json!("50ms"),
                json!(20),
                json!(1.5),
                json!("1s"),
                json!("3h"),
            ],
            _ => vec![
                json!("slow"),
                json!("fast"),
                json!("/dev/y"),
                json!(""),
                json!("a \"b\" # c\n\\d = '\u{e9}'"),
            ],
        };
        Ok(u.choose(&values)?.clone())
    };
    if allowed[word.len()..].starts_with("[]") {
        let length = u.int_in_range(0..=3)?;
        return (0..length).map(|_| one(u)).collect();
    }
    one(u)
}

fn read(model: &Parameters, text: &str) -> Configuration {
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", text);
    let (configuration, found) = rc_configuration::check(&sources, source, Some(model));
    assert!(!found.has_errors(), "{}\n{text}", check(model, text).1);
    configuration
}

/// The value of each parameter at the next start.
fn next(live: &LiveParameters) -> HashMap<String, Json> {
    let all = live.list(&[]).expect("all parameters");
    let value = |p: ParameterStatus| (p.path, p.pending.unwrap_or(p.value));
    all.into_iter().map(value).collect()
}

/// The lines that a change removed from a text, and the lines that it added.
fn difference<'t>(old: &'t str, new: &'t str) -> (Vec<&'t str>, Vec<&'t str>) {
    let (mut old, mut new): (Vec<_>, Vec<_>) = (old.lines().collect(), new.lines().collect());
    let same = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
    old.drain(..same);
    new.drain(..same);
    while !old.is_empty() && old.last() == new.last() {
        old.pop();
        new.pop();
    }
    (old, new)
}

/// Starts a component with a configuration that omits some optional parameters, and changes some of
/// its parameters.
fn changes(u: &mut Unstructured<'_>, count: &mut Count) -> Result<()> {
    let (model, pdsl, nodes) = made(u)?;
    let (mut lines, set) = fill(
        &rc_configuration::template("C", PERIOD, Some(&model)),
        &nodes,
    );
    let optional = |line: &&Line<'_>| match line.node.kind {
        Kind::Scalar { required, .. } => !required,
        Kind::Low | Kind::High => true,
        _ => false,
    };
    for line in set.iter().filter(optional) {
        if u.ratio(1, 3)? {
            lines[line.at] = String::from("# A comment.");
        }
    }
    let mut text = lines.join("\n") + "\n";
    let mut live = LiveParameters::new(model.clone(), &read(&model, &text).parameters);
    for _ in 0..12 {
        let all = live.list(&[]).expect("all parameters");
        let open: Vec<_> = all.iter().filter(|p| p.editable || p.restart).collect();
        if open.is_empty() {
            return Ok(());
        }
        let chosen = *u.choose(&open)?;
        let wanted = value(u, &chosen.allowed)?;
        let before = live.values();
        let about = format!("{} = {wanted}\n{text}\n{pdsl}", chosen.path);
        let Ok(accepted) = live.check([(chosen.path.as_str(), &wanted)]) else {
            count.refused += 1;
            continue;
        };
        let changed = accepted.changes.len() + accepted.pending.len();
        live.apply(accepted);
        assert_eq!(live.unsaved().len(), changed, "{about}");
        if chosen.restart {
            assert!(live.values() == before, "{about}");
        }
        let saved = match live.save(Path::new("config.toml"), &text) {
            Ok(saved) => saved,
            Err(SaveError::Conflicts(lines)) => panic!("{}\n{about}", lines.join("\n")),
            Err(SaveError::Invalid(sources, found)) => panic!(
                "{}\n{about}",
                render(&sources, &found, rc_diagnostics::Format::Short)
            ),
        };
        // The saved file has the values of the next start.
        let configuration = read(&model, &saved);
        let again = LiveParameters::new(model.clone(), &configuration.parameters);
        assert_eq!(next(&again), next(&live), "{saved}\n{about}");
        let waiting = live
            .list(&[])
            .expect("all")
            .iter()
            .any(|p| p.pending.is_some());
        if !waiting {
            // Secret values are saved, too.
            assert!(
                configuration.parameters == live.values(),
                "{saved}\n{about}"
            );
        }
        // The rest of the text is unchanged.
        let (old, new) = difference(&text, &saved);
        let name = chosen.path.rsplit('.').next().unwrap_or_default();
        let own = |line: &&str| line.starts_with(&format!("{name} = "));
        match (&old[..], &new[..]) {
            ([], []) => assert_eq!(changed, 0, "{saved}\n{about}"),
            ([], [line]) => {
                assert!(own(line), "{saved}\n{about}");
                count.added += 1;
            }
            ([from], [to]) => assert!(own(from) && own(to), "{saved}\n{about}"),
            _ => panic!("{old:?} became {new:?}\n{saved}\n{about}"),
        }
        count.accepted += changed;
        count.nan += usize::from(wanted.to_string().contains("nan"));
        live.saved();
        assert!(live.unsaved().is_empty(), "{about}");
        text = saved;
    }
    Ok(())
}

#[test]
fn accepted_changes_are_saved_and_all_other_lines_stay() {
    let mut count = Count::default();
    for n in 1..=600_u64 {
        arbtest(|u| changes(u, &mut count))
            .seed(n << 32 | 2048)
            .run();
    }
    let Count {
        accepted,
        refused,
        added,
        nan,
    } = count;
    let summary = format!("{accepted} accepted, {added} of them new, {nan} nan; {refused} refused");
    assert!(
        accepted > 500 && added > 50 && nan > 20 && refused > 100,
        "{summary}"
    );
}

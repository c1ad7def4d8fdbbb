//! Prints models as lines.

use rc_diagnostics::{Format, SourceMap, render};
use rc_smdsl::StateMachine;
use rc_smdsl::model::{Action, Region, StateKind};
use rc_syntax::Name;

/// The diagnostics and the model of the text `text` of the file `name`.
pub(crate) fn read(name: &str, text: &str) -> (String, Option<StateMachine>) {
    let mut sources = SourceMap::new();
    let source = sources.add(name, text);
    let (machine, found) = rc_smdsl::load(&sources, source);
    (render(&sources, &found, Format::Short), machine)
}

/// The states, indented below their parents, then the transitions.
pub(crate) fn shown(machine: &StateMachine) -> String {
    let mut out = format!("{}{}\n", machine.name.text, doc(&machine.top.doc));
    region(machine, &machine.top, 1, &mut out);
    for transition in &machine.transitions {
        let mut line = format!("{} =>", machine.state(transition.source).name.text);
        for target in &transition.targets {
            line += &format!(" {}", machine.state(*target).name.text);
        }
        if !transition.events.is_empty() {
            line += &format!(", on {}", texts(&transition.events));
        }
        line += &transition
            .cond
            .as_ref()
            .map_or(String::new(), |c| format!(", if {}", c.text()));
        if transition.internal {
            line += ", internal";
        }
        line += &actions(", doing", &transition.actions);
        out += &format!("{line}{}\n", doc(&transition.doc));
    }
    out
}

fn region(machine: &StateMachine, region: &Region, depth: usize, out: &mut String) {
    for id in &region.states {
        let state = machine.state(*id);
        let mut line = format!("{}{}", "  ".repeat(depth), state.name.text);
        if region.initial.contains(id) {
            line += " initial";
        }
        line += match state.kind {
            StateKind::Plain => "",
            StateKind::End => " end",
            StateKind::History { deep: false } => " history",
            StateKind::History { deep: true } => " deep history",
        };
        line += &actions(", entry", &state.on_entry.concat());
        line += &actions(", exit", &state.on_exit.concat());
        line += &doc(&state.doc);
        if let Some(region) = &state.region {
            line += if region.parallel {
                ", all of"
            } else {
                ", one of"
            };
            line += &doc(&region.doc);
            line += &actions(", first", &region.actions);
            let deeper = region.initial.iter().map(|id| machine.state(*id));
            let deeper = deeper.filter(|s| s.parent != Some(*id));
            line += &deeper
                .map(|s| format!(", enters {}", s.name.text))
                .collect::<String>();
        }
        out.push_str(&line);
        out.push('\n');
        if let Some(region) = &state.region {
            self::region(machine, region, depth + 1, out);
        }
    }
}

fn texts(names: &[Name]) -> String {
    let texts: Vec<&str> = names.iter().map(|n| n.text.as_str()).collect();
    texts.join(" or ")
}

fn doc(lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    format!(" \"{}\"", lines.join("|"))
}

fn actions(what: &str, actions: &[Action]) -> String {
    let text = |name: &Option<Name>| name.as_ref().map_or("-".to_owned(), |n| n.text.clone());
    actions
        .iter()
        .map(|action| match action {
            Action::Raise(event) => format!("{what} raise {}", event.text),
            Action::Send { event, delay, id } => {
                format!("{what} send {} after {delay:?} as {}", event.text, text(id))
            }
            Action::Cancel(id) => format!("{what} cancel {}", id.text),
            Action::Call(name) => format!("{what} call {}", name.text),
            Action::Log { label, expr } => format!("{what} log {} {}", text(label), text(expr)),
        })
        .collect()
}

//! Texts in the worker of an old component in C++ for which a new one has no counterpart.

use rc_cdsl::ast::Clause;
use rc_diagnostics::SourceMap;
use std::io;
use std::path::Path;

/// A text in the code of an old worker, and what takes its place.
const GONE: [(&str, &str); 22] = [
    (
        "QTimer",
        "the runtime runs compute() once a period; remove the timer",
    ),
    (
        "timer.start",
        "the runtime runs compute() once a period; remove the timer",
    ),
    (
        "QMutex",
        "all functions of the worker run on one thread; remove the lock",
    ),
    (
        "std::mutex",
        "all functions of the worker run on one thread; it is only for threads of your own",
    ),
    (
        "USE_QTGUI",
        "a worker with `gui Qt(…);` is a window; remove the condition",
    ),
    (
        "DSR::",
        "no shared world in C++; write this worker in Rust or Python (`world`), or ask a component that has it",
    ),
    (
        "G->",
        "no shared world in C++; write this worker in Rust or Python (`world`), or ask a component that has it",
    ),
    (
        "InnerModel",
        "no tree of InnerModel in C++; call the component `inner_model`, or write this worker in Rust or Python",
    ),
    (
        "IceStorm",
        "there is no broker; the slots of `publishes` and `subscribesTo` connect themselves",
    ),
    ("topicManager", "there is no broker; remove it"),
    (
        "Ice::Current",
        "handlers have the parameters of the IDSL only",
    ),
    ("Ice::Communicator", "the runtime connects slots; remove it"),
    (
        "MapPrx",
        "the constructor has no parameters; proxies are members of GenericWorker",
    ),
    (
        "TuplePrx",
        "the constructor has no parameters; proxies are members of GenericWorker",
    ),
    (
        "ParameterList",
        "a .pdsl declares parameters, `params` has their values",
    ),
    (
        "configLoader",
        "a .pdsl declares parameters, `params` has their values",
    ),
    (
        "startup_check",
        "`ctest` runs tests/worker_test.cpp in its place",
    ),
    (
        "hibernation",
        "the network decides when a component runs (`rcdeploy stop`, `start`)",
    ),
    (
        "GRAFCETStep",
        "a file that `statemachine` of the .cdsl names has the states",
    ),
    (
        "statemachine.",
        "the runtime runs the state machine; remove it",
    ),
    (
        "std::cout",
        "rc::log_info(\"…\") writes a line of the log; for std::cout, include <iostream>",
    ),
    (
        "setPeriod(\"",
        "setPeriod has one argument, milliseconds; a state machine has one period",
    ),
];

/// Those of a worker without a window.
const GONE_WITHOUT_WINDOW: [(&str, &str); 7] = [
    (
        "Q_OBJECT",
        "a worker is a QObject with `gui Qt(QWidget);` only; remove it",
    ),
    (
        "SIGNAL(",
        "no signals of Qt; a handler or compute() runs in place of the slot",
    ),
    (
        "SLOT(",
        "no slots of Qt; a handler or compute() runs in place of it",
    ),
    (
        "QObject::connect",
        "no signals of Qt; a handler or compute() runs in place of the slot",
    ),
    ("qDebug", "rc::log_debug(\"…\") writes a line of the log"),
    ("qInfo", "rc::log_info(\"…\") writes a line of the log"),
    (
        "qWarning",
        "rc::log_warning(\"…\") writes a line of the log",
    ),
];

/// Whether a description has a window of Qt.
fn has_window(cdsl: &Path) -> io::Result<bool> {
    let text = rc_files::read(cdsl).map_err(|error| crate::paths::named(cdsl, &error))?;
    let mut sources = SourceMap::new();
    let source = sources.add(cdsl, &text);
    let (file, _) = rc_cdsl::parse(&sources, source);
    let mut clauses = file.component.into_iter().flat_map(|of| of.clauses);
    Ok(clauses.any(|(_, clause)| {
        matches!(clause, Clause::Gui(toolkit, _) if toolkit.text.eq_ignore_ascii_case("Qt"))
    }))
}

/// Where the worker beside an old description has such a text: `FILE:LINE: TEXT: …`. Each text once a file, in the order
/// of the lines.
///
/// # Errors
/// A file cannot be read.
pub fn gone(cdsl: &Path) -> io::Result<Vec<String>> {
    let without_window = if has_window(cdsl)? {
        &[][..]
    } else {
        &GONE_WITHOUT_WINDOW[..]
    };
    let folder = cdsl.parent().unwrap_or(Path::new("")).join("src");
    let mut all = Vec::new();
    for name in ["specificworker.h", "specificworker.cpp"] {
        let path = folder.join(name);
        if !path.is_file() {
            continue;
        }
        let text = rc_files::read_bytes(&path);
        let text = text.map_err(|error| crate::paths::named(&path, &error))?;
        // Comments of old files may be Latin-1.
        let text = String::from_utf8_lossy(&text);
        let words = without_window.iter().chain(&GONE);
        let found = words.filter_map(|(word, instead)| {
            let line = text.lines().position(|line| uses(line, word))?;
            Some((line + 1, word, instead))
        });
        let mut found: Vec<_> = found.collect();
        found.sort_by_key(|(line, ..)| *line);
        all.extend(found.iter().map(|(line, word, instead)| {
            format!("{}:{line}: `{word}`: {instead}", path.display())
        }));
    }
    Ok(all)
}

/// Whether a line of code has a text that no longer name contains.
fn uses(line: &str, word: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    let mut places = code.match_indices(word);
    places.any(|(at, _)| {
        let before = code[..at].chars().next_back();
        before.is_none_or(|c| !(c.is_ascii_alphanumeric() || c == '_'))
    })
}

#[cfg(test)]
mod tests {
    use super::uses;

    #[test]
    fn comments_and_longer_names_do_not_count() {
        assert!(uses("    QTimer timer;", "QTimer"));
        assert!(uses("auto n = G->get_node(1);", "G->"));
        assert!(!uses("// QTimer", "QTimer"));
        assert!(!uses("LOG->write();", "G->"));
    }
}

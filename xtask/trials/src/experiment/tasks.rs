//! The tasks, and what of them a person types.

use std::path::Path;

/// Step of a person, or of a tool for them.
pub(super) enum Step {
    /// Types a file.
    Write(String, &'static str),
    /// Changes a text that is once in a file.
    Change(String, &'static str, &'static str),
    /// Types a command, which makes or generates files.
    Command(Vec<String>),
    /// Types `rcgen stubs COMPONENT`, and pastes its output.
    Paste(&'static str),
    /// Types `rcdeploy up --build NETWORK`, which generates and builds what has changed.
    Up,
}

/// One task.
pub(super) struct Task {
    pub(super) name: &'static str,
    pub(super) steps: Vec<Step>,
    /// The component and the text in its log that show the result. Numbers are left out: a call
    /// that misses its deadline skips one.
    pub(super) shows: Option<(&'static str, &'static str)>,
}

/// Counts of typed lines. A line counts if it is not blank, and new or changed; a command is a
/// line. Removed lines do not count, nor does what a tool writes or prints to be pasted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Typed {
    pub(super) descriptions: usize,
    pub(super) rust: usize,
    pub(super) commands: usize,
}

impl Typed {
    pub(super) fn sum(self) -> usize {
        self.descriptions + self.rust + self.commands
    }

    pub(super) fn add(&mut self, step: &Step) {
        let (file, old, new) = match step {
            Step::Write(file, text) => (file, "", *text),
            Step::Change(file, old, new) => (file, *old, *new),
            Step::Command(_) | Step::Paste(_) | Step::Up => {
                self.commands += 1;
                return;
            }
        };
        let mut before: Vec<&str> = old.lines().collect();
        let lines = new.lines().filter(|line| !line.trim().is_empty());
        let typed = lines.filter(|line| match before.iter().position(|old| old == line) {
            Some(at) => {
                before.swap_remove(at);
                false
            }
            None => true,
        });
        let count = typed.count();
        if Path::new(file).extension().is_some_and(|e| e == "rs") {
            self.rust += count;
        } else {
            self.descriptions += count;
        }
    }
}

const COUNTER: &str = "components/counter/src/specific_worker.rs";
const READER: &str = "components/reader/src/specific_worker.rs";

fn write(file: &str, text: &'static str) -> Step {
    Step::Write(file.to_owned(), text)
}

fn change(file: &str, old: &'static str, new: &'static str) -> Step {
    Step::Change(file.to_owned(), old, new)
}

fn command(words: &str) -> Step {
    Step::Command(words.split(' ').map(str::to_owned).collect())
}

/// All tasks, in a workspace whose first network is `network`.
pub(super) fn all(network: &str) -> Vec<Task> {
    vec![
        server(network),
        client(),
        deploy(network),
        library_and_class(),
        new_method(),
        new_interface(),
        new_proxy(),
    ]
}

fn server(network: &str) -> Task {
    Task {
        name: "before: an interface and a server",
        steps: vec![
            command(&format!("rcgen init {network}")),
            write(
                "interfaces/Counter.idsl",
                "module Counter\n{\n    interface Counter\n    {\n        int add(int amount);\n    };\n};\n",
            ),
            command("rcgen new counter --implements Counter"),
            change(
                COUNTER,
                "pub struct SpecificWorker {}",
                "pub struct SpecificWorker {\n    total: i32,\n}",
            ),
            change(COUNTER, "Ok(Self {})", "Ok(Self { total: 0 })"),
            change(
                COUNTER,
                "        let _ = (ctx, amount);\n        Default::default()",
                "        let _ = ctx;\n        self.total += amount;\n        self.total",
            ),
        ],
        shows: None,
    }
}

fn client() -> Task {
    Task {
        name: "before: a client",
        steps: vec![
            command("rcgen new reader --requires Counter"),
            change(
                READER,
                "use reader_generated::{",
                "use reader_generated::tracing::info;\nuse reader_generated::{",
            ),
            change(
                READER,
                "        let _ = ctx;\n        Ok(())",
                "        let count = ctx.counter.add(2)?;\n        info!(\"{count} so far\");\n        Ok(())",
            ),
        ],
        shows: None,
    }
}

fn deploy(network: &str) -> Task {
    Task {
        name: "1. deploy a small component network",
        steps: vec![
            change(
                &format!("deployments/{network}.ddsl"),
                "    // Component guard { cdsl \"../components/guard/guard.cdsl\"; };",
                "    Component counter { cdsl \"../components/counter/counter.cdsl\"; };\n    \
                 Component reader { cdsl \"../components/reader/reader.cdsl\"; };",
            ),
            Step::Up,
        ],
        shows: Some(("reader", " so far")),
    }
}

fn library_and_class() -> Task {
    Task {
        name: "2. include a new library and a class",
        steps: vec![
            change(
                "components/counter/counter.cdsl",
                "    period 100ms;",
                "    period 100ms;\n    dependencies { libm \"0.2\"; };",
            ),
            Step::Paste("counter"),
            write(
                "components/counter/src/average.rs",
                "//! An average in whole numbers.\n\n#[derive(Default)]\npub struct Average {\n    sum: f64,\n    count: f64,\n}\n\n\
                 impl Average {\n    pub fn add(&mut self, value: f64) -> f64 {\n        self.sum += value;\n        self.count += 1.0;\n        \
                 libm::round(self.sum / self.count)\n    }\n}\n",
            ),
            change(
                "components/counter/src/lib.rs",
                "mod specific_worker;",
                "mod average;\nmod specific_worker;",
            ),
            change(
                COUNTER,
                "use counter_generated::{",
                "use crate::average::Average;\nuse counter_generated::tracing::info;\nuse counter_generated::{",
            ),
            change(
                COUNTER,
                "    total: i32,\n",
                "    total: i32,\n    average: Average,\n",
            ),
            change(
                COUNTER,
                "Ok(Self { total: 0 })",
                "Ok(Self { total: 0, average: Average::default() })",
            ),
            change(
                COUNTER,
                "        self.total += amount;",
                "        info!(\"{} on average\", self.average.add(f64::from(amount)));\n        self.total += amount;",
            ),
            Step::Up,
        ],
        shows: Some(("counter", "2 on average")),
    }
}

fn new_method() -> Task {
    Task {
        name: "3. a new method of an interface",
        steps: vec![
            change(
                "interfaces/Counter.idsl",
                "        int add(int amount);",
                "        int add(int amount);\n        int half();",
            ),
            Step::Paste("counter"),
            change(
                COUNTER,
                "    fn half(&mut self, ctx: &mut Context) -> i32 {\n        let _ = ctx;\n        Default::default()",
                "    fn half(&mut self, ctx: &mut Context) -> i32 {\n        let _ = ctx;\n        self.total / 2",
            ),
            change(
                READER,
                "        info!(\"{count} so far\");",
                "        info!(\"{count} so far, half of it is {}\", ctx.counter.half()?);",
            ),
            Step::Up,
        ],
        shows: Some(("reader", " so far, half of it is ")),
    }
}

fn new_interface() -> Task {
    Task {
        name: "4. a component provides a new interface",
        steps: vec![
            change(
                "components/counter/counter.cdsl",
                "import \"Counter.idsl\";",
                "import \"Counter.idsl\";\nimport \"Speech.idsl\";",
            ),
            change(
                "components/counter/counter.cdsl",
                "implements Counter;",
                "implements Counter, Speech;",
            ),
            Step::Paste("counter"),
            change(
                COUNTER,
                "        let _ = (ctx, request_);\n        Default::default()",
                "        let _ = ctx;\n        info!(\"says {}\", request_.text);\n        Dataresponse { result: true, ..Default::default() }",
            ),
            Step::Up,
        ],
        shows: Some(("reader", " so far")),
    }
}

fn new_proxy() -> Task {
    Task {
        name: "5. a new proxy for an interface",
        steps: vec![
            change(
                "components/reader/reader.cdsl",
                "import \"Counter.idsl\";",
                "import \"Counter.idsl\";\nimport \"Speech.idsl\";",
            ),
            change(
                "components/reader/reader.cdsl",
                "requires Counter;",
                "requires Counter, Speech;",
            ),
            Step::Command(vec!["rcgen".to_owned(), "generate".to_owned()]),
            change(
                READER,
                "use reader_generated::{",
                "use reader_generated::Datasayin;\nuse reader_generated::{",
            ),
            change(
                READER,
                "        Ok(())",
                "        ctx.speech.say(&Datasayin { text: count.to_string(), overwrite: false })?;\n        Ok(())",
            ),
            Step::Up,
        ],
        shows: Some(("counter", "says ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_and_changed_lines_are_typed() {
        let mut typed = Typed::default();
        typed.add(&write("a.cdsl", "one\n\n  two\n"));
        typed.add(&change(
            "a.rs",
            "one\ntwo\ntwo",
            "zero\ntwo\nthree\ntwo\ntwo",
        ));
        typed.add(&change("a.rs", "one\ntwo", ""));
        typed.add(&Step::Up);
        let expected = Typed {
            descriptions: 2,
            rust: 3,
            commands: 1,
        };
        assert_eq!(typed, expected);
    }
}

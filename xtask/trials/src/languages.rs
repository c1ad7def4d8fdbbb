//! `cargo xtask bench generator` and `cargo xtask bench languages`: the times of the generator and
//! of the checker, as whole processes.

use crate::figure::Figure;
use crate::pair::quantile;
use crate::programs::{Failure, finish, root, target};
use crate::usage::processor_time_of_children;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Runs of each program.
const RUNS: usize = 20;
/// The limit of a run.
pub(crate) const LIMIT: Duration = Duration::from_mins(1);
/// The size of a large text, in bytes.
const LARGE: usize = 1 << 20;

/// Generates a component of this workspace, one with ten interfaces and one in Python.
pub(crate) fn generator() -> Result<Vec<Figure>, Failure> {
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    write_components(folder, 100)?;
    let simulator = || -> Result<Duration, Failure> {
        let mut command = rcgen(&root())?;
        command.args(["--check", "components/simulator/simulator.cdsl"]);
        Ok(finish(command, LIMIT)?.0)
    };
    let ten = || -> Result<Duration, Failure> {
        let _ = fs::remove_dir_all(folder.join("out"));
        let mut command = rcgen(folder)?;
        command.args(["c0.cdsl", "--out", "out"]);
        Ok(finish(command, LIMIT)?.0)
    };
    let many = folder.join("many");
    fs::create_dir(&many)?;
    write_components(&many, 1000)?;
    let index = || -> Result<Duration, Failure> {
        let mut command = rcgen(&many)?;
        command.args(["index", "."]);
        Ok(finish(command, LIMIT)?.0)
    };
    let python = || -> Result<Duration, Failure> {
        let mut command = rcgen(&root().join("components/avoider_python"))?;
        command.arg("avoider_python.cdsl");
        Ok(finish(command, LIMIT)?.0)
    };
    Ok(vec![
        figure(
            "`rcgen --check simulator.cdsl`, processor time, mean of 20",
            used(&simulator)?,
            ("< 10 ms", 10),
        ),
        figure(
            "the same, whole process, median of 20",
            median(&mut || simulator())?,
            ("< 13 ms", 13),
        ),
        figure(
            "`rcgen` for a component with ten interfaces into an empty folder, processor time, mean of 20",
            used(&ten)?,
            ("< 20 ms", 20),
        ),
        figure(
            "the same, whole process, median of 20",
            median(&mut || ten())?,
            ("< 20 ms", 20),
        ),
        figure(
            "`rcgen avoider_python.cdsl`, a worker in Python, median of 20",
            median(&mut || python())?,
            ("< 20 ms", 20),
        ),
        figure(
            "`rcgen index` of 1,000 components with ten interfaces each, processor time, mean of 20",
            used(&index)?,
            ("< 1 s", 1000),
        ),
        figure(
            "the same, whole process, median of 20",
            median(&mut || index())?,
            ("< 1 s", 1000),
        ),
    ])
}

fn rcgen(folder: &Path) -> Result<Command, Failure> {
    let mut command = Command::new(target()?.join("release/rcgen"));
    command.current_dir(folder);
    Ok(command)
}

/// The processor time of a run. The clock of ended processes has steps of 10 ms, so that all runs
/// are one measurement.
fn used(run: &dyn Fn() -> Result<Duration, Failure>) -> Result<Duration, Failure> {
    let before = processor_time_of_children()?;
    for _ in 0..RUNS {
        run()?;
    }
    Ok(processor_time_of_children()?.saturating_sub(before) / RUNS as u32)
}

/// Checks 200 files, and one file of 1 MB of every language, right and wrong.
pub(crate) fn figures() -> Result<Vec<Figure>, Failure> {
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    write_components(folder, 100)?;
    let mut figures = Vec::new();
    let check = median(&mut || {
        let mut command = rcgen(folder)?;
        command.args(["check", "."]);
        Ok(finish(command, LIMIT)?.0)
    })?;
    figures.push(figure(
        "`rcgen check` of 200 files (100 components with ten interfaces each), median of 20",
        check,
        ("< 200 ms", 200),
    ));
    for (ending, what) in [
        (
            "idsl",
            "`rcgen check` of a right and of a wrong .idsl of 1 MB, the longer one",
        ),
        ("cdsl", "the same of a .cdsl"),
        ("pdsl", "the same of a .pdsl"),
        ("smdsl", "the same of a .smdsl"),
        ("ddsl", "the same of a .ddsl"),
    ] {
        let mut longest = Duration::ZERO;
        for wrong in [false, true] {
            let name = format!("large.{ending}");
            fs::write(folder.join(&name), large(ending, wrong))?;
            let mut command = rcgen(folder)?;
            // A text with mistakes makes the exit code 1; only the time counts here.
            command.args(["check", "--format", "short", &name]);
            let started = std::time::Instant::now();
            let outcome = finish(command, LIMIT);
            if !wrong {
                outcome?;
            }
            longest = longest.max(started.elapsed());
        }
        figures.push(figure(what, longest, ("< 1 s", 1000)));
    }
    Ok(figures)
}

pub(crate) fn figure(what: &'static str, measured: Duration, goal: (&'static str, u64)) -> Figure {
    let (goal, milliseconds) = goal;
    Figure {
        what,
        goal,
        measured: format!("{:.1} ms", measured.as_secs_f64() * 1000.0),
        met: measured < Duration::from_millis(milliseconds),
    }
}

pub(crate) fn median(
    run: &mut dyn FnMut() -> Result<Duration, Failure>,
) -> Result<Duration, Failure> {
    let mut times = (0..RUNS).map(|_| run()).collect::<Result<Vec<_>, _>>()?;
    Ok(quantile(&mut times, 0.5))
}

/// 100 interfaces and `count` components with ten of them each.
fn write_components(folder: &Path, count: usize) -> Result<(), Failure> {
    for number in 0..100 {
        let interface = format!(
            "module M{number} {{ enum Mode {{ slow, fast }}; struct Data {{ int a; string b; sequence<double> c; Mode d; }};\n\
             exception Failed {{ string what; }};\n\
             interface I{number} {{ Data get(int index, Mode mode) throws Failed; void set(Data data); double sum(); }}; }};\n"
        );
        fs::write(folder.join(format!("I{number}.idsl")), interface)?;
    }
    for number in 0..count {
        let used: Vec<usize> = (0..10).map(|n| (number + n * 7) % 100).collect();
        let imports: String = used
            .iter()
            .map(|n| format!("import \"I{n}.idsl\";\n"))
            .collect();
        let names = |used: &[usize]| {
            let names: Vec<String> = used.iter().map(|n| format!("I{n}")).collect();
            names.join(", ")
        };
        let component = format!(
            "{imports}Component c{number} {{ Communications {{ implements {}; requires {}; }}; language rust; }};\n",
            names(&used[..5]),
            names(&used[5..]),
        );
        fs::write(folder.join(format!("c{number}.cdsl")), component)?;
    }
    Ok(())
}

/// A text of 1 MB.
fn large(ending: &str, wrong: bool) -> String {
    let (mut text, end) = match ending {
        "idsl" => ("module Large {\n".to_owned(), "};\n"),
        "cdsl" => (
            "import \"I0.idsl\";\nComponent large { language rust; Communications {\nrequires I0"
                .to_owned(),
            ";\n};\n};\n",
        ),
        "pdsl" => ("ComponentParams large {\n".to_owned(), "};\n"),
        "smdsl" => (
            "large { initial_state first; transitions {\n".to_owned(),
            "};\nstates last; };\n",
        ),
        _ => ("Deployment large {\n".to_owned(), "};\n"),
    };
    let mut number = 0;
    let mut states = String::new();
    while text.len() + states.len() < LARGE {
        let piece = match (ending, wrong) {
            ("idsl", false) => format!(
                "struct S{number} {{ int a; string b; }};\ninterface I{number} {{ void f(S{number} x, out double y); }};\n"
            ),
            ("idsl", true) => format!(
                "struct S{number} {{ int a; strin b; }};\ninterface I{number} {{ void f(S{number} x; out double y) }};\n"
            ),
            ("cdsl", false) => ",\n I0".to_owned(),
            ("cdsl", true) => format!(",\n I{number} {{ depht 3; }}"),
            ("pdsl", false) => format!("p{number} int 3 0:10 T unit \"m\";\n"),
            ("pdsl", true) => format!("p{number} itn 30 0:10 T unit;\n"),
            ("smdsl", false) => format!("first => s{number};\n"),
            ("smdsl", true) => format!("frist => s{number};\n s{number} => ;\n"),
            (_, false) => format!("Component c{number} {{ cdsl \"c0.cdsl\"; }};\n"),
            _ => format!("Component c{number} {{ cdls \"c0.cdsl\"; after x; }};\n"),
        };
        text.push_str(&piece);
        if ending == "smdsl" && !wrong {
            states.push_str(&format!("s{number}, "));
        }
        number += 1;
    }
    text + &end.replace("last", &format!("{states}last"))
}

//! `rcgen stubs`: missing handlers of a worker after a change of its description.

use crate::folders::{changed, files, rcgen};
use expect_test::{Expect, expect};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const IDSL: &str = "module M {
    struct Point { float x; };
    sequence<Point> Points;
    exception Refused { string why; };
    interface Voice {
        /// Says it.
        bool say(string text, @range(min=0) int loudness) throws Refused;
        void hush();
        Points path(Point from, out int length);
    };
    interface Goal { void reached(Points path); };
};
";
const CDSL: &str = "import \"M.idsl\";
Component c { Communications { implements Voice; subscribesTo Goal as goals; }; language rust; };
";
const WORKER: &str = "src/specific_worker.rs";

/// A generated component.
struct Component(TempDir);

impl Component {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let component = Self(folder);
        component.write("M.idsl", IDSL);
        component.write("c.cdsl", CDSL);
        assert_eq!(rcgen(component.path(), &["c.cdsl"]).0, 0);
        component
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, file: &str, text: &str) {
        fs::write(self.path().join(file), text).expect("a file");
    }

    fn text(&self, file: &str) -> String {
        fs::read_to_string(self.path().join(file)).expect("a text")
    }

    /// Replaces a text that must exist.
    fn replace(&self, file: &str, from: &str, to: &str) {
        let text = self.text(file);
        assert!(text.contains(from), "{text}");
        self.write(file, &text.replace(from, to));
    }

    /// Removes the text from `from` up to `to`.
    fn cut(&self, from: &str, to: &str) {
        let text = self.text(WORKER);
        let start = text.find(from).expect("the beginning");
        let end = start + text[start..].find(to).expect("the end");
        self.write(WORKER, &format!("{}{}", &text[..start], &text[end..]));
    }

    /// Runs `rcgen stubs`. Checks that it changes no file.
    fn stubs(&self) -> (i32, String, String) {
        let before = files(self.path());
        let result = rcgen(self.path(), &["stubs", "c.cdsl", "--format", "short"]);
        assert_eq!(changed(&before, &files(self.path())), [""; 0]);
        result
    }

    fn check(&self, code: i32, out: &Expect, err: &Expect) {
        let (exit, stdout, stderr) = self.stubs();
        out.assert_eq(&stdout);
        err.assert_eq(&stderr);
        assert_eq!(exit, code);
    }
}

#[test]
fn a_new_worker_needs_no_stubs() {
    let component = Component::new();
    component.check(
        0,
        &expect![""],
        &expect![[r"
            c.cdsl: nothing is missing; handlers: 4
        "]],
    );
    let json = ["stubs", "c.cdsl", "--format", "json"];
    let nothing = (0, String::new(), String::new());
    assert_eq!(rcgen(component.path(), &json), nothing);
}

#[test]
fn a_missing_handler_is_printed_with_its_imports() {
    let component = Component::new();
    component.cut("    fn path(", "}\n\nimpl Goal");
    component.replace(WORKER, "Point, ", "");
    component.check(
        0,
        &expect![[r"
            // ./src/specific_worker.rs: uses this, too
            use c_generated::Point;

            // ./src/specific_worker.rs:19: into this `impl Voice<Context> for SpecificWorker`
                fn path(&mut self, ctx: &mut Context, from: Point) -> (Points, i32) {
                    let _ = (ctx, from);
                    Default::default()
                }
        "]],
        &expect![""],
    );
}

#[test]
fn a_component_without_a_library_gets_its_lines() {
    let component = Component::new();
    let lib = component.text("src/lib.rs");
    fs::remove_file(component.path().join("src/lib.rs")).expect("it was there");
    component.replace("src/main.rs", "c::Specific", "specific_worker::Specific");
    component.check(
        0,
        &expect![[r"
            // ./src/lib.rs: a new file, with all modules of main.rs
            //! The component `c`.

            mod specific_worker;

            pub use specific_worker::SpecificWorker;

            // ./src/main.rs: all of it
            //! Runs the component `c`.

            fn main() -> std::process::ExitCode {
                c_generated::run::<c::SpecificWorker>()
            }
        "]],
        &expect![""],
    );
    component.write("src/lib.rs", &lib);
    assert_eq!(component.stubs().1, "");
}

#[test]
fn stubs_equal_the_code_of_a_new_worker() {
    let component = Component::new();
    let text = component.text(WORKER);
    let at = text.find("impl Voice").expect("the handlers");
    component.write(WORKER, &text[..at]);
    let (code, out, err) = component.stubs();
    assert_eq!((code, err.as_str()), (0, ""));
    let code: String = out
        .lines()
        .filter(|line| !line.starts_with("// "))
        .map(|line| format!("{line}\n"))
        .collect();
    assert_eq!(code, text[at..]);
}

#[test]
fn an_empty_worker_gets_every_handler() {
    let component = Component::new();
    component.write(
        WORKER,
        "use c_generated::{Context, Worker, WorkerError};\n\
         struct Robot;\n\
         impl Worker<Context> for Robot {}\n",
    );
    component.check(
        0,
        &expect![[r"
            // ./src/specific_worker.rs: uses this, too
            use c_generated::{Goals, Point, Points, SayError, Voice};

            // ./src/specific_worker.rs: at the end
            impl Voice<Context> for Robot {
                /// Says it.
                ///
                /// - `loudness`: at least 0
                fn say(&mut self, ctx: &mut Context, text: String, loudness: i32) -> Result<bool, SayError> {
                    let _ = (ctx, text, loudness);
                    Ok(Default::default())
                }

                fn hush(&mut self, ctx: &mut Context) {
                    let _ = ctx;
                }

                fn path(&mut self, ctx: &mut Context, from: Point) -> (Points, i32) {
                    let _ = (ctx, from);
                    Default::default()
                }
            }

            // ./src/specific_worker.rs: at the end
            impl Goals<Context> for Robot {
                fn reached(&mut self, ctx: &mut Context, path: Points) {
                    let _ = (ctx, path);
                }
            }
        "]],
        &expect![""],
    );
}

/// A worker of an earlier rcgen.
#[test]
fn an_impl_without_its_context_is_told_the_line() {
    let component = Component::new();
    component.replace(WORKER, "<Context> for", " for");
    component.check(0, &expect![""], &expect![[r"
        ./src/specific_worker.rs:7:6: warning[handler-context]: `Worker` needs the types `<Context>`: error E0107 of rustc (write `impl Worker<Context> for SpecificWorker`)
        ./src/specific_worker.rs:19:6: warning[handler-context]: `Voice` needs the types `<Context>`: error E0107 of rustc (write `impl Voice<Context> for SpecificWorker`)
        ./src/specific_worker.rs:38:6: warning[handler-context]: `Goals` needs the types `<Context>`: error E0107 of rustc (write `impl Goals<Context> for SpecificWorker`)
        c.cdsl: nothing is missing; handlers: 4
    "]]);
    let (code, _, err) = rcgen(component.path(), &["check", "c.cdsl", "--format", "short"]);
    assert_eq!(code, 0);
    assert_eq!(err.matches("warning[handler-context]").count(), 3, "{err}");
}

#[test]
fn a_value_that_serves_a_slot_needs_no_handlers() {
    let component = Component::new();
    component.cut("impl Voice<Context> for", "impl Goals<Context> for");
    assert!(component.stubs().1.contains("impl Voice<Context> for"));
    let text = component.text(WORKER);
    let served = "impl c_generated::interfaces::voice::ServeVoice<Context> for SpecificWorker {}\n";
    component.write(WORKER, &(text + served));
    assert_eq!(component.stubs().1, "");
}

/// Slots of one interface are told apart by their markers.
#[test]
fn a_value_that_serves_one_of_three_slots_leaves_the_handlers_of_the_others() {
    let component = Component::new();
    let text = component.text("c.cdsl");
    let slots = "implements Voice, Voice as second, Voice as third;";
    assert_eq!(text.matches("implements Voice;").count(), 1);
    component.write("c.cdsl", &text.replace("implements Voice;", slots));
    let text = component.text(WORKER);
    let missing = |imports: &str, generics: &str, parameters: &str| {
        let serving =
            format!("{imports}\nimpl{parameters} ServeVoice{generics} for SpecificWorker {{}}\n");
        component.write(WORKER, &format!("{text}{serving}"));
        let (code, out, err) = component.stubs();
        assert_eq!(code, 0, "{err}");
        [
            "impl Second<Context, SecondSlot>",
            "impl Third<Context, ThirdSlot>",
        ]
        .map(|line| out.contains(line))
    };
    let serve = "use c_generated::interfaces::voice::ServeVoice;";
    assert_eq!(missing(serve, "<Context>", ""), [true, true]);
    assert_eq!(missing(serve, "<Context, ThirdSlot>", ""), [true, false]);
    assert_eq!(
        missing(serve, "<Context, slots::SecondSlot>", ""),
        [false, true]
    );
    assert_eq!(missing(serve, "<C, S>", "<C, S>"), [false, false]);
    let renamed = format!("{serve} use c_generated::slots::SecondSlot as Mark;");
    assert_eq!(missing(&renamed, "<Context, Mark>", ""), [false, true]);
}

#[test]
fn undeclared_handlers_are_reported() {
    let component = Component::new();
    component.replace(WORKER, "fn hush", "fn shush");
    component.replace("c.cdsl", " subscribesTo Goal as goals;", "");
    component.check(0, &expect![[r"
        // ./src/specific_worker.rs:19: into this `impl Voice<Context> for SpecificWorker`
            fn hush(&mut self, ctx: &mut Context) {
                let _ = ctx;
            }
    "]], &expect![[r"
        ./src/specific_worker.rs:28:8: note[stale-handler]: `Voice` does not declare `shush` any more: error E0407 of rustc (remove it, or is it `hush` now?)
        ./src/specific_worker.rs:38:6: note[stale-handler]: no slot `Goals` receives anything any more (remove this `impl`, and the trait where it is imported)
    "]]);
}

#[test]
fn changed_signatures_are_reported() {
    let component = Component::new();
    component.replace(WORKER, "text: String", "text: f32");
    component.replace(
        WORKER,
        "fn hush(&mut self, ctx: &mut Context)",
        "fn hush(&self, ctx: &Context)",
    );
    component.replace(
        WORKER,
        "from: Point) -> (Points, i32)",
        "from: Point) -> Points",
    );
    component.check(0, &expect![""], &expect![[r"
        ./src/specific_worker.rs:23:8: warning[handler-signature]: `say` is declared by `Voice` with another signature (needed now: `fn say(&mut self, ctx: &mut Context, text: String, loudness: i32) -> Result<bool, SayError>`)
        ./src/specific_worker.rs:28:8: warning[handler-signature]: `hush` is declared by `Voice` with another signature (needed now: `fn hush(&mut self, ctx: &mut Context)`)
        ./src/specific_worker.rs:32:8: warning[handler-signature]: `path` is declared by `Voice` with another signature (needed now: `fn path(&mut self, ctx: &mut Context, from: Point) -> (Points, i32)`)
        c.cdsl: nothing is missing; handlers: 4
    "]]);
}

/// Types that may be equal cause no error.
#[test]
fn equivalent_types_are_not_reported() {
    let component = Component::new();
    component.replace(WORKER, "text: String", "_: std::string::String");
    component.replace(WORKER, "-> Result<bool, SayError>", "-> Answer<bool>");
    component.replace(
        WORKER,
        "path: Points",
        "mut path: Vec<c_generated::types::m::Point>",
    );
    component.replace(WORKER, "(Points, i32)", "(Track, r#i32)");
    component.replace(
        WORKER,
        "fn hush(&mut self, ctx: &mut Context)",
        "fn hush<'a>(self: &mut Self, _ctx: &'a mut (Context)) -> ()",
    );
    component.write("src/types.rs", "#!/bin/sh\npub type Track = Vec<u8>;\n");
    component.check(
        0,
        &expect![""],
        &expect![[r"
        c.cdsl: nothing is missing; handlers: 4
    "]],
    );
}

#[test]
fn renamed_traits_and_workers_in_tests_are_handled() {
    let component = Component::new();
    component.replace(WORKER, "Voice,", "Voice as Sound,");
    component.replace(
        WORKER,
        "impl Voice<Context> for SpecificWorker",
        "impl Sound<Context> for SpecificWorker",
    );
    let text = component.text(WORKER);
    let at = text.find("impl Goals").expect("the topic");
    component.write(WORKER, &text[..at]);
    fs::create_dir(component.path().join("src/parts")).expect("a folder");
    let goals = text[at..]
        .replace("impl Goals", "impl c_generated::Goals")
        .replace("SpecificWorker", "super::SpecificWorker");
    let test = "#[cfg(test)]\nmod tests {\n    struct Fake;\n    impl super::Worker for Fake {}\n    impl super::Voice for Fake {}\n}\n";
    component.write("src/parts/goals.rs", &format!("{test}{goals}"));
    component.check(
        0,
        &expect![""],
        &expect![[r"
        c.cdsl: nothing is missing; handlers: 4
    "]],
    );
}

#[test]
fn invalid_rust_is_reported() {
    let component = Component::new();
    component.replace(WORKER, "let _ = ctx;", "let é = ;");
    component.write("src/main.rs", "fn main() {\n    (\n}\n");
    component.write("src/end.rs", "fn");
    fs::write(component.path().join("src/bytes.rs"), [0xff, 0xfe]).expect("a file");
    component.check(1, &expect![""], &expect![[r"
        ./src/bytes.rs:1:1: error[not-utf8]: this file is not UTF-8
        ./src/end.rs:1:3: error[not-rust]: this cannot be read as Rust: unexpected end of input, expected identifier (`cargo check` says more)
        ./src/main.rs:3:1: error[not-rust]: this cannot be read as Rust from here on (`cargo check` says more)
        ./src/specific_worker.rs:9:17: error[not-rust]: this cannot be read as Rust: expected an expression (`cargo check` says more)
    "]]);
}

#[test]
fn a_component_without_generated_code_is_reported() {
    let component = Component::new();
    fs::remove_dir_all(component.path().join("src")).expect("it was there");
    component.check(1, &expect![""], &expect![[r"
        c.cdsl:2:11: error[no-worker]: there is no ./src yet (`rcgen c.cdsl` writes it, with all handlers)
    "]]);
}

#[test]
fn folder_and_import_paths_can_be_given() {
    let component = Component::new();
    for folder in ["here", "idsl"] {
        fs::create_dir(component.path().join(folder)).expect("a folder");
    }
    let path = |name: &str| -> PathBuf { component.path().join(name) };
    fs::rename(path("src"), path("here/src")).expect("a move");
    fs::rename(path("M.idsl"), path("idsl/M.idsl")).expect("a move");
    assert_eq!(component.stubs().0, 1);
    let args = ["stubs", "c.cdsl", "-I", "idsl", "--out", "here"];
    let (code, out, err) = rcgen(component.path(), &args);
    let wanted = "c.cdsl: nothing is missing; handlers: 4\n";
    assert_eq!((code, out.as_str(), err.as_str()), (0, "", wanted));
    assert_eq!(rcgen(component.path(), &["stubs", "M.idsl"]).0, 2);
    assert_eq!(rcgen(component.path(), &["stubs"]).0, 2);
    assert_eq!(rcgen(component.path(), &["stubs", "none.cdsl"]).0, 3);
}

/// A generation that changes a trait reports missing handlers once.
#[test]
fn generation_reports_missing_handlers() {
    let component = Component::new();
    let worker = component.text(WORKER);
    component.replace("M.idsl", "void hush();", "void hush(int how); int hum();");
    component.replace(
        "c.cdsl",
        "subscribesTo Goal as goals",
        "subscribesTo Goal as goals, Goal",
    );
    let (code, _, err) = rcgen(component.path(), &["c.cdsl", "--format", "short"]);
    assert_eq!(code, 0);
    expect![[r"
        ./src/specific_worker.rs:7:6: note[missing-handlers]: `SpecificWorker` lacks `impl Goal` (`rcgen stubs c.cdsl` prints them)
        ./src/specific_worker.rs:19:6: note[missing-handlers]: `SpecificWorker` lacks the handlers of `Voice`: `hum` (`rcgen stubs c.cdsl` prints them)
        ./src/specific_worker.rs:28:8: warning[handler-signature]: `hush` is declared by `Voice` with another signature (needed now: `fn hush(&mut self, ctx: &mut Context, how: i32)`)
    "]].assert_eq(&err);
    assert_eq!(component.text(WORKER), worker);
    let again = rcgen(component.path(), &["c.cdsl"]);
    assert_eq!(again, (0, String::new(), String::new()));
}

#[test]
fn the_functions_of_a_state_machine_are_handlers_too() {
    let component = Component::new();
    component.write(
        "m.scxml",
        "<scxml><state id='idle'><transition event='go' cond='isReady' target='off'>
        <script>stop_motors</script></transition></state><state id='lost'/><final id='off'/></scxml>",
    );
    component.replace(
        "c.cdsl",
        "language rust",
        "statemachine \"m.scxml\"; language rust",
    );
    component.check(
        0,
        &expect![[r"
            // ./src/specific_worker.rs: uses this, too
            use c_generated::StateMachine;

            // ./src/specific_worker.rs: at the end
            impl StateMachine for SpecificWorker {
                fn is_ready(&mut self, ctx: &mut Context) -> bool {
                    let _ = ctx;
                    true
                }

                fn stop_motors(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
                    let _ = ctx;
                    Ok(())
                }
            }

            // Of `impl StateMachine for SpecificWorker`, each as you need it:
            // use c_generated::machine::{MachineEvent, MachineState};
            // use c_generated::{Context, WorkerError};
            //
            // /// Runs when `idle` is entered.
            // fn entry_idle(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs when `idle` is left.
            // fn exit_idle(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs once a period while `idle` is active, in place of `compute`.
            // fn during_idle(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs when `lost` is entered.
            // fn entry_lost(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs when `lost` is left.
            // fn exit_lost(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs once a period while `lost` is active, in place of `compute`.
            // fn during_lost(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs when `off` is entered.
            // fn entry_off(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs when `off` is left.
            // fn exit_off(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
            //
            // /// Runs once a period while `off` is active, in place of `compute`.
            // fn during_off(&mut self, ctx: &mut Context) -> Result<(), WorkerError>
        "]],
        &expect![[r"
            m.scxml:2:69: warning[no-way-in]: no transition leads to state `lost`
        "]],
    );
    // Two kinds of states have two names. The name of earlier versions says which is which.
    assert_eq!(rcgen(component.path(), &["c.cdsl"]).0, 0);
    let root = component.text("generated/src/lib.rs");
    let names = "rc_runtime::names_of_workers!(machine);";
    assert!(root.contains(names), "{root}");
    let worker = component
        .text(WORKER)
        .replace("Worker, ", "StateMachine, Worker, ");
    let during = "fn during_lost(&mut self, _: &mut Context) -> Result<(), WorkerError> { Ok(()) }";
    let more = format!(
        "impl StateMachine for SpecificWorker {{ {during}\nfn during_of(&mut self) {{}} }}\n"
    );
    component.write(WORKER, &(worker + &more));
    let (code, out, err) = component.stubs();
    assert_eq!(code, 0, "{err}");
    assert!(
        out.contains("into this `impl StateMachine for SpecificWorker`"),
        "{out}"
    );
    assert!(
        out.contains("fn is_ready(")
            && !out.contains("\nuse c_generated")
            && !out.contains("fn during_lost"),
        "{out}"
    );
    assert!(
        err.contains("does not declare `during_of` any more"),
        "{err}"
    );
    assert!(!err.contains("during_lost"), "{err}");
    // At a check, and at each generation.
    for args in [&["check", "c.cdsl"][..], &["c.cdsl"]] {
        let args = [args, &["--format", "short"]].concat();
        let (code, _, err) = rcgen(component.path(), &args);
        assert_eq!(code, 0, "{err}");
        assert!(
            err.contains("warning[unreachable-during]: `during_lost` never runs"),
            "{err}"
        );
    }
}

#[test]
fn names_of_states_that_become_one_in_rust_are_reported() {
    let component = Component::new();
    component.replace(
        "c.cdsl",
        "language rust",
        "statemachine \"m.smdsl\"; language rust",
    );
    component.write(
        "m.smdsl",
        "m { initial_state a_b; states aB, self, match; transitions { a_b => aB, self, match; }; };",
    );
    let (code, _, err) = component.stubs();
    assert_eq!(code, 1);
    let states = "error[name-collision]: states `a_b` and `aB` are both `entry_a_b` in Rust";
    assert!(err.contains(states), "{err}");
    assert_eq!(err.lines().count(), 1, "{err}");
}

#[test]
fn a_function_of_a_machine_with_a_name_of_the_worker_is_reported() {
    for name in [
        "initialize",
        "compute",
        "params_changed",
        "emergency",
        "restore",
        "finalize",
    ] {
        let component = Component::new();
        component.replace(
            "c.cdsl",
            "language rust",
            "statemachine \"m.scxml\"; language rust",
        );
        component.write(
            "m.scxml",
            &format!(
                "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" name=\"m\" initial=\"a\">\
                 <state id=\"a\"><onentry><script>{name}</script></onentry></state></scxml>"
            ),
        );
        let (code, _, err) = component.stubs();
        assert_eq!(code, 1, "{err}");
        let wanted = format!(
            "error[name-collision]: the function `{name}` has the name of a function of the worker"
        );
        assert!(err.contains(&wanted), "{err}");
    }
}

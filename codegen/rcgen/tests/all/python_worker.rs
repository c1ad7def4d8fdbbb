//! Components in Python: generated files, and findings about their workers.

use crate::folders::{changed, files, rcgen};
use expect_test::{expect, expect_file};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python");
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const WORKER: &str = "src/specific_worker.py";

/// The generated component `guard`.
struct Guard(TempDir);

impl Guard {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for file in ["guard.cdsl", "guard.pdsl", "Guard.idsl"] {
            let from = Path::new(FIXTURES).join(file);
            fs::copy(from, folder.path().join(file)).expect("a copy");
        }
        let (code, _, err) = rcgen(folder.path(), &["guard.cdsl"]);
        assert_eq!((code, err.as_str()), (0, ""));
        Self(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn text(&self, file: &str) -> String {
        fs::read_to_string(self.path().join(file)).expect("a text")
    }

    /// Replaces a text that must exist.
    fn replace(&self, file: &str, from: &str, to: &str) {
        let text = self.text(file);
        assert!(text.contains(from), "{text}");
        fs::write(self.path().join(file), text.replace(from, to)).expect("a file");
    }

    fn run(&self, args: &[&str]) -> (i32, String) {
        let (code, out, err) = rcgen(self.path(), args);
        (code, out + &err)
    }
}

#[test]
fn the_package_of_a_component() {
    let guard = Guard::new();
    let mut all = String::new();
    for (path, text) in files(guard.path()) {
        let name = path.to_string_lossy();
        let is_shown = !name.ends_with(".md") && !name.ends_with("schema.json");
        if is_shown
            && !name.starts_with("guard.")
            && name != "Guard.idsl"
            && name != "etc/config.toml"
        {
            let text = String::from_utf8(text).expect("UTF-8");
            all += &format!("#### {name}\n{text}\n");
        }
    }
    expect_file![format!("{FIXTURES}/guard.txt")].assert_eq(&all);
}

/// Python sets attributes without functions, so none takes the name of an attribute.
#[test]
fn an_attribute_of_a_world_keeps_a_name_that_begins_with_set() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |file: &str, text: &str| {
        fs::write(folder.path().join(file), text).expect("a file");
    };
    write(
        "lamps.gdsl",
        "Domain lamps { entity lamp { name string key; level int; set_level int; }; };\n",
    );
    write(
        "dimmer.cdsl",
        "Component dimmer\n{\n    Communications { };\n    language python;\n    world \"lamps.gdsl\" as g { writes lamp; };\n};\n",
    );
    let (code, _, err) = rcgen(folder.path(), &["dimmer.cdsl"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let world = folder.path().join("generated/dimmer/world.py");
    let world = fs::read_to_string(world).expect("a text");
    assert!(
        world.contains("    def set_level(self, value: int"),
        "{world}"
    );
}

#[test]
fn what_the_user_owns_stays_and_the_rest_is_renewed() {
    let guard = Guard::new();
    guard.replace(WORKER, "\"\"\"Runs once a period.\"\"\"", "print(\"mine\")");
    fs::create_dir(guard.path().join("generated/guard/__pycache__")).expect("a folder");
    let cache = guard.path().join("generated/guard/__pycache__/context.pyc");
    fs::write(&cache, "").expect("a file");
    fs::write(guard.path().join("generated/guard/old.py"), "").expect("a file");
    let before = files(guard.path());
    let (code, said) = guard.run(&["guard.cdsl"]);
    assert_eq!(
        (code, said.as_str()),
        (0, "remove ./generated/guard/old.py\n")
    );
    assert_eq!(
        changed(&before, &files(guard.path())),
        ["generated/guard/old.py"]
    );
    assert_eq!(
        guard.run(&["generate", "--check", "guard.cdsl"]),
        (0, String::new())
    );
    let (code, said) = guard.run(&["clean", "guard.cdsl"]);
    assert_eq!((code, said.as_str()), (0, "remove ./generated\n"));
}

#[test]
fn a_worker_that_does_not_fit_is_reported() {
    let guard = Guard::new();
    assert_eq!(guard.run(&["check", "guard.cdsl"]), (0, String::new()));
    assert_eq!(
        guard.run(&["stubs", "guard.cdsl"]).1,
        "guard.cdsl: nothing is missing; handlers: 4\n"
    );
    // An annotation that nobody knows may mean the type.
    guard.replace(WORKER, "care: float", "care: Care");
    guard.replace(
        WORKER,
        "def compute(self, ctx: Context)",
        "def compute(self, ctx)",
    );
    assert_eq!(guard.run(&["check", "guard.cdsl"]).0, 0);
    guard.replace(WORKER, "care: Care", "care: str");
    guard.replace(
        WORKER,
        "def others_raised(self, ctx: Context, picture: Picture)",
        "async def others_raised(self, ctx, picture)",
    );
    guard.replace(
        WORKER,
        "def watch_forget(self, ctx: Context, ",
        "def watch_forgot(self, ctx: Context, ",
    );
    guard.replace(
        WORKER,
        "def initialize(self, ctx: Context)",
        "def initialize(self)",
    );
    expect![[r"
        src/specific_worker.py:12:1: error[missing-handlers]: `SpecificWorker` lacks `watch_forget` (`rcgen stubs guard.cdsl` prints what is missing)
        src/specific_worker.py:15:5: error[handler-signature]: `initialize` takes other arguments: (self) (needed now: `def initialize(self, ctx: Context) -> None`)
        src/specific_worker.py:21:5: error[handler-signature]: `watch_look` has the type `str` where `float` is needed (needed now: `def watch_look(self, ctx: Context, care: float) -> LookAnswer`)
        src/specific_worker.py:24:5: note[stale-handler]: `watch_forgot` serves nothing: no slot, state or world has a function of this name (is it `watch_forget` now?)
        src/specific_worker.py:27:5: error[handler-signature]: `others_raised` is a coroutine, which is never awaited (needed now: `def others_raised(self, ctx: Context, picture: Picture) -> None`)
    "]]
    .assert_eq(&guard.run(&["check", "--format", "short", "guard.cdsl"]).1);
    let (code, out, err) = rcgen(guard.path(), &["stubs", "--format", "short", "guard.cdsl"]);
    assert_eq!(code, 0, "{err}");
    expect![[r"
        # src/specific_worker.py:28: at the end of the class `SpecificWorker`

            def watch_forget(self, ctx: Context, angles: npt.NDArray[np.float32]) -> None:
                raise NotImplementedError
    "]]
    .assert_eq(&out);
    guard.replace(
        "pyproject.toml",
        "opencv-python-headless>=4.10,<5",
        "opencv-python-headless>=3",
    );
    let (_, said) = guard.run(&["check", "--format", "short", "guard.cdsl"]);
    assert!(said.contains("warning[dependency-differs]"), "{said}");
}

/// A worker may leave these functions out, so a misspelled one would just never run. A function that the worker calls itself
/// is not one of them, though `restart` is near `restore`.
#[test]
fn a_misspelled_function_is_noted() {
    let guard = Guard::new();
    let domain = "Domain w { entity room { name string; }; };";
    fs::write(guard.path().join("w.gdsl"), domain).expect("a domain");
    guard.replace(
        "guard.cdsl",
        "language python",
        "world \"w.gdsl\" as g; language python",
    );
    guard.replace(
        WORKER,
        "    def compute(",
        "    def room_chnaged(self, ctx: Context, change: RoomChange) -> None:\n        self.restart()\n\n    def restart(self) -> None:\n        pass\n\n    def compute(",
    );
    guard.replace(WORKER, "def initialize(", "def initialise(");
    expect![[r"
        src/specific_worker.py:15:5: note[stale-handler]: `initialise` serves nothing: no slot, state or world has a function of this name (is it `initialize` now?)
        src/specific_worker.py:18:5: note[stale-handler]: `room_chnaged` serves nothing: no slot, state or world has a function of this name (is it `room_changed` now?)
    "]].assert_eq(&guard.run(&["check", "--format", "short", "guard.cdsl"]).1);
}

#[test]
fn functions_of_states_are_printed_with_their_imports() {
    let guard = Guard::new();
    fs::write(
        guard.path().join("m.scxml"),
        "<scxml><state id='idle'><transition event='go' cond='isReady' target='off'/></state>
        <final id='off'/></scxml>",
    )
    .expect("a chart");
    guard.replace(
        "guard.cdsl",
        "language python",
        "statemachine \"m.scxml\"; language python",
    );
    guard.replace(
        WORKER,
        "    def compute(",
        "    def entry_idle(self, ctx: Context) -> None:\n        pass\n\n    def compute(",
    );
    let (code, said) = guard.run(&["stubs", "guard.cdsl"]);
    assert_eq!(code, 0, "{said}");
    expect![[r#"
        # src/specific_worker.py:31: at the end of the class `SpecificWorker`

            def is_ready(self, ctx: Context) -> bool:
                raise NotImplementedError

        # Of the class `SpecificWorker`, each as you need it:
        # from guard.context import Context
        # from guard.machine import Event, State
        #
        # def exit_idle(self, ctx: Context) -> None:
        #     """Runs when `idle` is left."""
        #
        # def during_idle(self, ctx: Context) -> None:
        #     """Runs once a period while `idle` is active, in place of `compute`."""
        #
        # def entry_off(self, ctx: Context) -> None:
        #     """Runs when `off` is entered."""
        #
        # def exit_off(self, ctx: Context) -> None:
        #     """Runs when `off` is left."""
        #
        # def during_off(self, ctx: Context) -> None:
        #     """Runs once a period while `off` is active, in place of `compute`."""
    "#]]
    .assert_eq(&said);
}

#[test]
fn a_generation_tells_workers_of_the_earlier_order_of_replies() {
    let guard = Guard::new();
    let interface = "generated/guard/interfaces/watch.py";
    let (result, out) = ("    result: list[_guard.Echo]\n", "    count_: int\n");
    let now = format!("{result}{out}");
    guard.replace(interface, &now, &format!("{out}{result}"));
    let (code, said) = guard.run(&["check", "--format", "short", "guard.cdsl"]);
    assert_eq!(code, 0, "{said}");
    expect![[r"
        guard.cdsl:4:11: warning[reply-order]: the replies of `look` begin with the result now, in the order of the IDSL: (result, count_) (change where the order matters: src/specific_worker.py:9, src/specific_worker.py:21)
    "]].assert_eq(&said);
    let (code, again) = guard.run(&["--format", "short", "guard.cdsl"]);
    assert_eq!(code, 0, "{again}");
    assert!(again.contains(said.trim()), "{again}");
    assert!(guard.text(interface).contains(&now));
    // It is told once: the package is the new one.
    assert_eq!(guard.run(&["check", "guard.cdsl"]), (0, String::new()));
}

#[test]
fn handlers_may_come_from_other_files_and_from_packages() {
    let guard = Guard::new();
    guard.replace(
        WORKER,
        "class SpecificWorker(Worker):",
        "class SpecificWorker(Silent, Worker):",
    );
    guard.replace(WORKER, "def others_raised", "def raised");
    let silent = guard.path().join("src/silent.py");
    fs::write(
        &silent,
        "class Silent:\n    def others_raised(self, ctx, picture):\n        pass\n",
    )
    .expect("a file");
    assert_eq!(guard.run(&["check", "guard.cdsl"]), (0, String::new()));
    // A class from elsewhere may have the function.
    fs::write(&silent, "from package import Silent\n").expect("a file");
    assert_eq!(guard.run(&["check", "guard.cdsl"]), (0, String::new()));
    fs::write(&silent, "class Silent:\n    pass\n").expect("a file");
    assert_eq!(guard.run(&["check", "guard.cdsl"]).0, 1);
}

#[test]
fn a_file_that_hides_a_module_of_python_is_reported() {
    let guard = Guard::new();
    let src = guard.path().join("src");
    for folder in ["email", "guarding", "json"] {
        fs::create_dir(src.join(folder)).expect("a folder");
    }
    // A folder without `__init__.py` hides nothing, and neither does the content of a package.
    let files = [
        "queue.py",
        "numpy.py",
        "email/__init__.py",
        "email/parser.py",
    ];
    for file in files
        .into_iter()
        .chain(["json/queue.py", "guarding/queue.py", "camera.py"])
    {
        fs::write(src.join(file), "").expect("a file");
    }
    let (code, said) = guard.run(&["check", "--format", "short", "guard.cdsl"]);
    assert_eq!(code, 0, "{said}");
    expect![[r"
        src/email/__init__.py:1:1: warning[hidden-module]: this hides the module `email` of Python, also from its library (give it another name, as `my_email`)
        src/numpy.py:1:1: warning[hidden-module]: this hides the module `numpy` of Python, also from its library (give it another name, as `my_numpy`)
        src/queue.py:1:1: warning[hidden-module]: this hides the module `queue` of Python, also from its library (give it another name, as `my_queue`)
    "]].assert_eq(&said);
}

#[test]
fn a_worker_that_is_no_python_is_reported_with_its_line() {
    let guard = Guard::new();
    guard.replace(
        WORKER,
        "    def compute(self, ctx: Context) -> None:",
        "    def compute(self, ctx -> None:",
    );
    let (code, said) = guard.run(&["check", "--format", "short", "guard.cdsl"]);
    assert_eq!(code, 1);
    assert!(said.starts_with("src/specific_worker.py:18:"), "{said}");
    assert!(
        said.contains("error[python-syntax]: this is not Python: "),
        "{said}"
    );
    assert_eq!(guard.run(&["stubs", "guard.cdsl"]).0, 1);
}

#[test]
fn without_a_python_it_says_what_is_needed() {
    let guard = Guard::new();
    let old = guard.path().join("old");
    fs::create_dir(&old).expect("a folder");
    let rcgen = |path: &Path, command: &str| {
        let mut rcgen = Command::new(env!("CARGO_BIN_EXE_rcgen"));
        rcgen.args([command, "guard.cdsl", "--format", "short"]);
        rcgen
            .current_dir(guard.path())
            .env("PATH", path)
            .env_remove("VIRTUAL_ENV");
        let output = rcgen.output().expect("rcgen starts");
        (
            output.status.code(),
            String::from_utf8(output.stderr).expect("UTF-8"),
        )
    };
    expect![[r"
        guard.cdsl:4:11: warning[no-python]: the worker cannot be checked: `python3` does not exist; a component in Python needs Python 3.11 or newer (install it, or activate a virtual environment that has it)
    "]]
    .assert_eq(&rcgen(&old, "check").1);
    assert_eq!(rcgen(&old, "stubs").0, Some(1));
    let python = old.join("python3");
    fs::write(&python, "#!/bin/sh\necho '{\"version\": \"3.9.2\"}'\n").expect("a file");
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(&python, mode).expect("a mode");
    let (code, said) = rcgen(&old, "check");
    assert_eq!(code, Some(0));
    assert!(
        said.contains(
            "`python3` is Python 3.9.2; a component in Python needs Python 3.11 or newer"
        ),
        "{said}"
    );
}

#[test]
fn names_that_python_has_for_something_else_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let check = |name: &str, idsl: &str, slots: &str| {
        fs::write(
            folder.path().join("M.idsl"),
            format!("module M {{ {idsl} }};"),
        )
        .expect("a file");
        let cdsl = format!(
            "import \"M.idsl\"; Component {name} {{ Communications {{ {slots} }}; language python; }};"
        );
        fs::write(folder.path().join("c.cdsl"), cdsl).expect("a file");
        let (code, _, err) = rcgen(folder.path(), &["c.cdsl", "--dry-run", "--format", "short"]);
        assert_eq!(code, 1, "{err}");
        err.lines()
            .map(|line| format!("{line}\n"))
            .collect::<String>()
    };
    let voice = "interface Voice { void say(); };";
    let mut all = check("queue", voice, "implements Voice;");
    all += &check("c", voice, "requires Voice as params;");
    all += &check(
        "c",
        "interface A { void bC(); }; interface A_B { void c(); };",
        "implements A, A_B;",
    );
    all += &check(
        "c",
        "enum E { aB, a_b }; interface Voice { void say(E e); };",
        "implements Voice;",
    );
    all += &check("c", voice, "requires Voice as ctx;");
    all += &check(
        "c",
        "interface Voice { int a_b(out int c); int AB(out int c); };",
        "implements Voice;",
    );
    expect![[r"
        c.cdsl:1:28: error[name-collision]: a component in Python cannot be called `queue`: Python has a module of this name
        c.cdsl:1:58: error[name-collision]: a slot cannot be called `params`: generated code uses the name itself (name it with `as`)
        c.cdsl:1:63: error[name-collision]: two functions of the worker would be called `a_b_c` (name the slot with `as`)
        M.idsl:1:25: error[name-collision]: enumerators `aB` and `a_b` are both `A_B` in Python; the other one at M.idsl:1:21
        c.cdsl:1:58: error[name-collision]: a slot cannot be called `ctx`: generated code uses the name itself (name it with `as`)
        M.idsl:1:54: error[name-collision]: the replies of `a_b` and `AB` are both `ABAnswer` in Python; the other one at M.idsl:1:34
    "]]
    .assert_eq(&all);
}

/// Everything that Python reads of values in place has a name of its own.
#[test]
fn values_in_place_make_room_for_the_names_of_the_idsl() {
    let folder = tempfile::tempdir().expect("a folder");
    let idsl = "module M {
        struct Image { int copy; sequence<byte, 16> data; };
        struct ImageView { int a; }; struct ImageLoan { int b; };
        interface Camera { void taken(Image image); };
        interface Store { Image last(); void lastInPlace(); Image other_in_place(); };
    };";
    fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
    let cdsl = "import \"M.idsl\"; Component c { Communications {
        publishes Camera; subscribesTo Camera as seen { in_place true; }; requires Store;
    }; language python; };";
    fs::write(folder.path().join("c.cdsl"), cdsl).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["c.cdsl"]);
    assert_eq!(code, 0, "{err}");
    // The declarations and their types.
    let mut all = String::new();
    for file in [
        "types/m.py",
        "interfaces/camera.py",
        "interfaces/store.py",
        "worker.py",
    ] {
        let path = folder.path().join("generated/c").join(file);
        let text = fs::read_to_string(path).expect("a file");
        let shown = text.lines().map(str::trim).filter(|line| {
            let is_shown = ["class ", "def ", "copy", "Image"].iter();
            is_shown.clone().any(|word| line.starts_with(word)) && line.contains("Image")
                || line.contains("in_place(")
                || line.starts_with("copy")
        });
        shown.for_each(|line| all += &format!("{line}\n"));
    }
    expect![[r"
        class Image(_robocomp.Struct):
        copy_: int = 0
        class ImageView(_robocomp.Struct):
        class ImageLoan(_robocomp.Struct):
        class ImageView_(_robocomp.View):
        copy_: int
        class ImageLoan_(ImageView_, _robocomp.Loan):
        ImageView_ = object
        ImageLoan_ = object
        def taken(self, image: _m.Image) -> None:
        def loan_taken(self) -> _m.ImageLoan_:
        def last(self) -> _m.Image:
        def last_in_place(self) -> _m.ImageView_:
        reply: _m.ImageView_ = self._query_in_place(0)
        def other_in_place_(self) -> _m.Image:
        def other_in_place_in_place(self) -> _m.ImageView_:
        reply: _m.ImageView_ = self._query_in_place(2)
        def seen_taken(self, ctx: Context, image: _m.ImageView_) -> None:
    "]]
    .assert_eq(&all);
}

/// Handlers of a slot array get the member, and a name that an input leaves free.
#[test]
fn handlers_of_slot_arrays_take_the_member() {
    let folder = tempfile::tempdir().expect("a folder");
    let idsl = "module M { struct Member { int a; };
        interface Club { void joined(Member member); void left(string who); }; };";
    fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
    let cdsl = "import \"M.idsl\"; Component c { Communications { subscribesTo Club[] as clubs; };
        language python; };";
    fs::write(folder.path().join("c.cdsl"), cdsl).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["c.cdsl"]);
    assert_eq!(code, 0, "{err}");
    let path = folder.path().join(WORKER);
    let worker = fs::read_to_string(&path).expect("a file");
    let (from, rest) = worker.split_once("\n\n\nclass").expect("a class");
    let from = from.rsplit("\n\n").next().expect("imports");
    let handlers = rest
        .split_once("    def clubs_joined")
        .expect("a handler")
        .1;
    expect![[r"
        from c import Context, Member, Worker, types
        (
                self, ctx: Context, member_: Member, member: types.m.Member
            ) -> None:
                raise NotImplementedError

            def clubs_left(self, ctx: Context, member: Member, who: str) -> None:
                raise NotImplementedError
    "]]
    .assert_eq(&format!("{from}\n{handlers}"));
    let check = || rcgen(folder.path(), &["check", "--format", "short", "c.cdsl"]);
    assert_eq!(check(), (0, String::new(), String::new()));
    fs::write(&path, worker.replace("member: Member, ", "")).expect("a file");
    let (code, _, err) = check();
    assert_eq!(code, 1, "{err}");
    let needed = "`clubs_left` takes other arguments: (self, ctx, who) (needed now: \
                  `def clubs_left(self, ctx: Context, member: Member, who: str) -> None`)";
    assert!(err.contains(needed), "{err}");
}

/// The name of a file is foreign: what it holds is neither code nor markup.
#[test]
fn the_name_of_a_file_ends_no_comment() {
    for language in ["python", "rust"] {
        let folder = tempfile::tempdir().expect("a folder");
        let name = "a\nraise SystemExit\r--> <b>.cdsl";
        let idsl = "module M { interface Voice { void say(); }; };";
        fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
        let cdsl = format!(
            "import \"M.idsl\"; Component c {{ Communications {{ implements Voice; }}; language {language}; }};"
        );
        fs::write(folder.path().join(name), cdsl).expect("a file");
        let (code, _, err) = rcgen(folder.path(), &[name]);
        assert_eq!(code, 0, "{err}");
        let mut cited = 0;
        for (path, text) in files(folder.path()) {
            let text = String::from_utf8(text).expect("UTF-8");
            assert!(!text.contains("\nraise"), "{path:?}\n{text}");
            assert!(!text.contains("SystemExit\r"), "{path:?}\n{text}");
            assert!(!text.contains("--> <b>"), "{path:?}\n{text}");
            cited += usize::from(text.contains("a\\nraise SystemExit\\r--&gt; <b&gt;.cdsl"));
        }
        assert!(cited > 3, "{language}");
    }
}

#[test]
fn a_workspace_of_cargo_leaves_components_in_python_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let (code, _, err) = rcgen(folder.path(), &["init", "robot", "--framework", ROOT]);
    assert_eq!(code, 0, "{err}");
    let robot: PathBuf = folder.path().join("robot");
    let args = [
        "new",
        "eyes",
        "--language",
        "python",
        "--requires",
        "Laser",
        "--publishes",
        "LaserPub",
    ];
    let (code, _, err) = rcgen(&robot, &args);
    assert_eq!(code, 0, "{err}");
    let manifest = fs::read_to_string(robot.join("Cargo.toml")).expect("a manifest");
    assert!(
        manifest.contains("exclude = [\"components/eyes\"]"),
        "{manifest}"
    );
    let before = files(&robot);
    let (code, out, err) = rcgen(&robot, &["generate"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    let metadata = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--offline",
            "--no-deps",
            "--format-version",
            "1",
        ])
        .current_dir(&robot)
        .output()
        .expect("cargo starts");
    let said = String::from_utf8_lossy(&metadata.stderr);
    assert!(metadata.status.success(), "{said}");
    assert!(robot.join("components/eyes/tests/test_worker.py").exists());
}

//! `cargo xtask bench editor`: a scripted session with `rcgen lsp`, a key stroke at a time, and
//! `cargo xtask soak editor`: VS Code in a browser, grammars for tree-sitter, and random edits.

mod window;

use crate::figure::{BUILD, Figure, table};
use crate::pair::quantile;
use crate::programs::{Failure, cargo, finish, target, tested};
use crate::usage::own_memory;
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// The size of the workspace.
const INTERFACES: usize = 200;
const COMPONENTS: usize = 300;
/// Key strokes in each file.
const STROKES: usize = 300;
/// Rounds of random edits with one seed.
const ROUNDS: u64 = 40;
/// How long a fast typist waits between two of them.
const PAUSE: Duration = Duration::from_millis(30);

/// Types into a file of 1,000 lines of a large workspace, and measures until its findings are there.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let profile = if smoke { "debug" } else { "release" };
    let mut words = vec!["build", "--workspace", "--bin", "rcgen"];
    if !smoke {
        words.push("--release");
    }
    finish(cargo(&words)?, BUILD)?;
    let (interfaces, components, strokes) = if smoke {
        (4, 6, 3)
    } else {
        (INTERFACES, COMPONENTS, STROKES)
    };
    let folder = tempfile::tempdir()?;
    write(folder.path(), interfaces, components)?;
    let mut editor = Editor::start(&target()?.join(profile).join("rcgen"), folder.path())?;
    let begun = Instant::now();
    // All files are checked before the symbols of all are listed.
    let known = editor.ask("workspace/symbol", &json!({ "query": "c0" }))?;
    let opened = begun.elapsed();
    if known.as_array().is_none_or(Vec::is_empty) {
        return Err("the workspace has no symbols".into());
    }
    let mut figures = vec![Figure {
        what: "opening the workspace, until all files are checked",
        goal: "",
        measured: format!("{:.1} s", opened.as_secs_f64()),
        met: true,
    }];
    for (file, what) in [
        (
            "I0.idsl",
            [
                "a key stroke in an .idsl of 1,000 lines that a third of the components read, p50",
                "the same, p99",
            ],
        ),
        (
            "net.ddsl",
            [
                "a key stroke in a .ddsl of 1,000 lines with all components, p50",
                "the same, p99",
            ],
        ),
        (
            "c0.cdsl",
            [
                "a key stroke in a .cdsl of 1,000 lines, p50",
                "the same, p99",
            ],
        ),
    ] {
        let mut times = editor.types(folder.path(), file, strokes)?;
        for (what, share, goal, limit) in [
            (what[0], 0.5, "< 10 ms", Duration::from_millis(10)),
            (what[1], 0.99, "< 50 ms", Duration::from_millis(50)),
        ] {
            let measured = quantile(&mut times, share);
            figures.push(Figure {
                what,
                goal,
                measured: format!("{:.1} ms", measured.as_secs_f64() * 1000.0),
                met: measured < limit,
            });
        }
    }
    let memory = own_memory(editor.server.id())?;
    figures.push(Figure {
        what: "private memory of the server after that",
        goal: "",
        measured: format!("{memory:.0} MB"),
        met: true,
    });
    if !table(figures) && !smoke {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Uses the extension of VS Code in a browser, Neovim and Emacs, compares the grammars for tree-sitter with
/// the languages, then random edits with checks from the start for a number of seconds.
pub(crate) fn soak(seconds: u64) -> Result<(), Failure> {
    window::use_it()?;
    tested(
        "Neovim and Emacs show findings, complete, rename and lay out",
        "-p rcgen --test all lsp::editors",
        [("RC_ALL_EDITORS", Path::new("1"))],
        BUILD,
    )?;
    parse_with_tree_sitter()?;
    let begun = Instant::now();
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH)?;
    let mut seed = u64::try_from(seed.as_micros())?;
    let mut rounds = 0;
    while begun.elapsed() < Duration::from_secs(seconds) {
        println!("RC_FUZZ_SEED={seed} RC_FUZZ_ROUNDS={ROUNDS}");
        let words = "test --package rcgen --test all after_random_edits";
        let mut fuzz = cargo(&words.split(' ').collect::<Vec<_>>())?;
        fuzz.env("RC_FUZZ_SEED", seed.to_string());
        fuzz.env("RC_FUZZ_ROUNDS", ROUNDS.to_string());
        finish(fuzz, BUILD)?;
        seed += 1;
        rounds += ROUNDS;
    }
    println!("{rounds} rounds of random edits: the findings are those of a check from the start");
    Ok(())
}

/// Generates the parsers of the grammars for tree-sitter, and compares what they accept with what the
/// languages accept.
fn parse_with_tree_sitter() -> Result<(), Failure> {
    let parsers = rc_test_support::folder()?.join("tree-sitter-parsers");
    let words =
        "run --quiet --manifest-path editors/tree-sitter/generate/Cargo.toml editors/tree-sitter";
    let mut generate = cargo(&words.split(' ').collect::<Vec<_>>())?;
    generate.arg(&parsers);
    finish(generate, BUILD)?;
    tested(
        "tree-sitter accepts what the languages accept, with the listed exceptions",
        "-p rcgen --test languages tree_sitter",
        [("RC_TREE_SITTER", parsers.as_path())],
        BUILD,
    )
}

/// An editor with its server.
struct Editor {
    server: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    next: u64,
}

impl Drop for Editor {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Editor {
    fn start(rcgen: &Path, folder: &Path) -> Result<Self, Failure> {
        let mut command = Command::new(rcgen);
        command
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        let mut server = command.spawn()?;
        let (Some(input), Some(output)) = (server.stdin.take(), server.stdout.take()) else {
            return Err("no pipes".into());
        };
        let mut editor = Self {
            server,
            input,
            output: BufReader::new(output),
            next: 0,
        };
        let root = uri(folder);
        editor.ask(
            "initialize",
            &json!({ "rootUri": root, "capabilities": {} }),
        )?;
        editor.tell("initialized", &json!({}))?;
        Ok(editor)
    }

    fn tell(&mut self, method: &str, parameters: &Value) -> Result<(), Failure> {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": parameters }))
    }

    fn send(&mut self, message: &Value) -> Result<(), Failure> {
        let body = message.to_string();
        write!(self.input, "Content-Length: {}\r\n\r\n{body}", body.len())?;
        self.input.flush()?;
        Ok(())
    }

    fn message(&mut self) -> Result<Value, Failure> {
        let mut length = 0;
        loop {
            let mut line = String::new();
            if self.output.read_line(&mut line)? == 0 {
                return Err("the server has ended".into());
            }
            match line.trim().split_once(": ") {
                Some((_, number)) => length = number.parse()?,
                None => break,
            }
        }
        let mut body = vec![0; length];
        self.output.read_exact(&mut body)?;
        Ok(serde_json::from_slice(&body)?)
    }

    fn ask(&mut self, method: &str, parameters: &Value) -> Result<Value, Failure> {
        self.next += 1;
        let id = self.next;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": parameters }))?;
        loop {
            let mut message = self.message()?;
            if message["id"] == id {
                return Ok(message["result"].take());
            }
        }
    }

    /// Types letters of a comment in the middle of a file, and takes each back. Returns how long the findings
    /// of each new text took.
    fn types(
        &mut self,
        folder: &Path,
        file: &str,
        strokes: usize,
    ) -> Result<Vec<Duration>, Failure> {
        let path = folder.join(file);
        let (uri, text) = (uri(&path), fs::read_to_string(path)?);
        let line = text.lines().count() / 2;
        let document = json!({ "uri": uri, "languageId": "robocomp", "version": 0, "text": text });
        self.tell("textDocument/didOpen", &json!({ "textDocument": document }))?;
        self.await_version(&uri, 0)?;
        let mut times = Vec::new();
        for version in 1..=strokes {
            std::thread::sleep(PAUSE);
            // A letter at the start of a line is a mistake, and the next stroke takes it back.
            let end = usize::from(version % 2 == 0);
            let new = if end == 0 { "x" } else { "" };
            let range = json!({
                "start": { "line": line, "character": 0 },
                "end": { "line": line, "character": end },
            });
            let begun = Instant::now();
            self.tell(
                "textDocument/didChange",
                &json!({
                    "textDocument": { "uri": uri, "version": version },
                    "contentChanges": [{ "range": range, "text": new }],
                }),
            )?;
            self.await_version(&uri, version)?;
            times.push(begun.elapsed());
        }
        Ok(times)
    }

    /// Waits for the findings of a version of a text.
    fn await_version(&mut self, uri: &str, version: usize) -> Result<(), Failure> {
        loop {
            let message = self.message()?;
            let published = &message["params"];
            if published["uri"] == uri && published["version"] == version {
                return Ok(());
            }
        }
    }
}

fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// Interfaces and components, of which a third reads the first interface, and a network of all.
fn write(folder: &Path, interfaces: usize, components: usize) -> Result<(), Failure> {
    for number in 0..interfaces {
        let members: String = if number == 0 {
            (0..480)
                .map(|at| format!("    int a{at};\n    // {at}\n"))
                .collect()
        } else {
            "    int a;\n    string b;\n    sequence<double> c;\n".to_owned()
        };
        let text = format!(
            "module M{number}\n{{\nenum Mode {{ slow, fast }};\nstruct Data\n{{\n{members}}};\n\
             exception Failed {{ string what; }};\ninterface I{number}\n{{\n\
             Data get(int index, Mode mode) throws Failed;\nvoid set(Data data);\n}};\n}};\n"
        );
        fs::write(folder.join(format!("I{number}.idsl")), text)?;
    }
    let mut network = "Deployment net\n{\n".to_owned();
    let used = |number: usize| {
        let all = (0..4).map(move |at| (number * 7 + at * 13 + 1) % interfaces);
        let first = (number.is_multiple_of(3)).then_some(0);
        let mut used: Vec<usize> = all.chain(first).collect();
        used.sort_unstable();
        used.dedup();
        used
    };
    for number in 0..components {
        let used = used(number);
        let imports: String = used
            .iter()
            .map(|at| format!("import \"I{at}.idsl\";\n"))
            .collect();
        let names: Vec<String> = used.iter().map(|at| format!("I{at} as s{at}")).collect();
        let comments: String = if number == 0 {
            (0..980).map(|at| format!("    // {at}\n")).collect()
        } else {
            String::new()
        };
        let text = format!(
            "{imports}\nComponent c{number}\n{{\n{comments}    Communications {{ implements {}; }};\n    language rust;\n}};\n",
            names.join(", ")
        );
        fs::write(folder.join(format!("c{number}.cdsl")), text)?;
        network.push_str(&format!(
            "    Component i{number}\n    {{\n        cdsl \"c{number}.cdsl\";\n    }};\n"
        ));
    }
    network.push_str("};\n");
    fs::write(folder.join("net.ddsl"), network)?;
    Ok(())
}

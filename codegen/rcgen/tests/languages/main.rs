//! Properties of every language: formatting keeps the meaning, and no text causes a panic.

mod grammar;
mod random;
mod tree_sitter;

use expect_test::expect;
use grammar::{Grammar, lay_out};
use random::Random;
use rc_diagnostics::{Diagnostics, Format, SourceId, SourceMap, render};
use rc_syntax::{MemoryLoader, Trivia};
use rcgen::languages::{LANGUAGES, Language};
use std::time::{Duration, Instant};

/// The syntax tree of a text without locations, and whether it has errors.
fn tree(language: Language, text: &str) -> (String, bool) {
    let mut sources = SourceMap::new();
    let source = sources.add(format!("a.{}", language.extension), text);
    let (tree, found) = match language.extension {
        "idsl" => debug(rc_idsl::parse(&sources, source)),
        "cdsl" => debug(rc_cdsl::parse(&sources, source)),
        "pdsl" => debug(rc_pdsl::parse(&sources, source)),
        "smdsl" => debug(rc_smdsl::parse(&sources, source)),
        "ddsl" => debug(rc_ddsl::parse(&sources, source)),
        "gdsl" => debug(graph_language::parse(&sources, source)),
        "dproto" => debug(rc_prototypes::parse(&sources, source)),
        "kdsl" => debug(rc_kinematics::parse(&sources, source)),
        other => panic!("no tree of a .{other}"),
    };
    (without_locations(&tree), found.has_errors())
}

fn debug<T: std::fmt::Debug>((tree, found): (T, Diagnostics)) -> (String, Diagnostics) {
    (format!("{tree:?}"), found)
}

fn without_locations(tree: &str) -> String {
    // The syntax tree of a rule of a .pdsl contains its text, for messages.
    let tree = without(tree, "}, text: \"", "\", message: ");
    without(&tree, "Span {", "}")
}

/// The text without the parts between `from` and `to`.
fn without(text: &str, from: &str, to: &str) -> String {
    let mut parts = text.split(from);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        out.push_str(part.split_once(to).map_or("", |(_, rest)| rest));
    }
    out
}

/// The comments of a text, without their layout.
fn comments(text: &str) -> Vec<String> {
    let trivia = Trivia::new(text);
    let words = |(start, stop): &(usize, usize)| {
        let words: Vec<&str> = text[*start..*stop].split_whitespace().collect();
        words.join(" ")
    };
    trivia.comments().iter().map(words).collect()
}

pub(crate) fn grammar_of(language: Language) -> Grammar {
    Grammar::new(match language.extension {
        "idsl" => include_str!("../../../../idsl/src/grammar.pest"),
        "cdsl" => include_str!("../../../../cdsl/src/grammar.pest"),
        "pdsl" => concat!(
            include_str!("../../../../pdsl/src/condition.pest"),
            include_str!("../../../../pdsl/src/grammar.pest")
        ),
        "smdsl" => include_str!("../../../../smdsl/src/grammar.pest"),
        "ddsl" => concat!(
            include_str!("../../../../pdsl/src/condition.pest"),
            include_str!("../../../../ddsl/src/grammar.pest")
        ),
        "gdsl" => include_str!("../../../../graph/language/src/grammar.pest"),
        "dproto" => include_str!("../../../../prototypes/src/grammar.pest"),
        "kdsl" => include_str!("../../../../kinematics/src/grammar.pest"),
        other => panic!("no grammar of .{other}"),
    })
}

#[test]
fn formatting_keeps_tree_and_comments_and_is_idempotent() {
    for language in LANGUAGES {
        let grammar = grammar_of(language);
        let (mut tried, mut read) = (0, 0);
        for seed in 0..if language.extension == "pdsl" {
            600
        } else {
            300
        } {
            let mut random = Random::new(seed);
            let text = lay_out(&grammar.words(&mut random), &mut random);
            let (before, wrong) = tree(language, &text);
            tried += 1;
            if wrong {
                continue;
            }
            read += 1;
            let printed = (language.print)(&text);
            let (after, _) = tree(language, &printed);
            let what = format!(
                ".{}, seed {seed}:\n{text}\n---\n{printed}",
                language.extension
            );
            assert_eq!(before, after, "the meaning of {what}");
            assert_eq!(comments(&text), comments(&printed), "comments of {what}");
            let again = (language.print)(&printed);
            assert_eq!(printed, again, "formatted twice, {what}");
        }
        assert!(
            read * 4 > tried,
            "only {read} of {tried} .{} texts were valid",
            language.extension
        );
    }
}

/// Passes a text through every step of the tools.
fn process(language: Language, text: &str) {
    let mut sources = SourceMap::new();
    let loader = MemoryLoader::new([("a.idsl", "module A { interface Laser { void x(); }; };")]);
    let source = sources.add(format!("b.{}", language.extension), text);
    let found = check(language, &mut sources, &loader, source);
    for format in [Format::Human, Format::Short, Format::Json] {
        render(&sources, &found, format);
    }
    (language.print)(sources.text(source));
}

fn check(
    language: Language,
    sources: &mut SourceMap,
    loader: &MemoryLoader,
    source: SourceId,
) -> Diagnostics {
    match language.extension {
        "idsl" => {
            let path = sources.path(source).to_path_buf();
            let mut session = rc_idsl::Session::new(sources, loader);
            session.load_source(source, &path);
            session.found
        }
        "cdsl" => rc_cdsl::load(sources, loader, source).1,
        "pdsl" => rc_pdsl::load(sources, loader, source).1,
        "smdsl" => rc_smdsl::load(sources, source).1,
        "gdsl" => graph_language::load(sources, loader, source).1,
        "dproto" => rc_prototypes::load(sources, loader, &[source]).1,
        "kdsl" => rc_kinematics::load(sources, loader, source).1,
        _ => rc_ddsl::load(sources, loader, source).1,
    }
}

/// A text with a few mistakes, like those of typing, merging and bad storage.
pub(crate) fn spoil(mut words: Vec<String>, other: &[String], random: &mut Random) -> Vec<u8> {
    for _ in 0..=random.below(4) {
        if words.is_empty() {
            break;
        }
        let at = random.below(words.len());
        match random.below(6) {
            0 => drop(words.remove(at)),
            1 => words.insert(at, words[at].clone()),
            2 => {
                let to = random.below(words.len());
                words.swap(at, to);
            }
            3 if !other.is_empty() => words[at].clone_from(random.one_of(other)),
            4 => words.truncate(at),
            _ => {
                let bits = [
                    "{",
                    "}",
                    "\"",
                    "/*",
                    "*/",
                    "<",
                    "é",
                    "\u{feff}",
                    "-",
                    "@",
                    "not",
                    "99999999999999999999",
                    "1e999",
                ];
                words.insert(at, (*random.one_of(&bits)).to_owned());
            }
        }
    }
    let mut bytes = lay_out(&words, random).into_bytes();
    if random.chance(4) && !bytes.is_empty() {
        let at = random.below(bytes.len());
        bytes[at] ^= 1 << random.below(8);
    }
    bytes
}

#[test]
fn a_file_without_its_last_brace_hides_no_other_error() {
    let mut all = String::new();
    for language in LANGUAGES {
        let texts = match language.extension {
            "idsl" => [
                "module M {\n struct S { int a; int a; };\n",
                "module M {\n enum E { x, x\n",
            ],
            "cdsl" => [
                "Component c {\n Communications {}; language klingon;\n",
                "Component c {\n language rust; Communications { requires Nobody;\n // the end",
            ],
            "pdsl" => [
                "ComponentParams c {\n a itn 3;\n",
                "ComponentParams c {\n a int 3; group g {\n a int 3:1;",
            ],
            "smdsl" => [
                "m {\n states a, a; initial_state b;\n",
                "m {\n initial_state a; transitions { a => a, a\n",
            ],
            "ddsl" => [
                "Deployment n {\n Component a { cdsl \"a.cdsl\"; restart sometimes; };\n",
                "Deployment n {\n Component a { cdsl \"a.cdsl\"; restart sometimes; after b;\n",
            ],
            "gdsl" => [
                "Domain d {\n entity a { x itn; };\n",
                "Domain d {\n entity a { x itn; y {one, two\n",
            ],
            "dproto" => [
                "axes A :: x, x\ndproto a :: b {\n c = d\n",
                "axes A :: x, x\nddr a :: idl {\n T\n",
            ],
            "kdsl" => [
                "import \"a.urdf\";\nKinematics k {\n solver s { pose tip in base; }; solver s {};\n",
                "import \"a.urdf\";\nKinematics k {\n solver s { iterations 1; iterations 2;\n",
            ],
            other => panic!("no text of .{other}"),
        };
        for text in texts {
            let mut sources = SourceMap::new();
            let robot = "<robot name=\"r\"><link name=\"base\"/></robot>";
            let loader = MemoryLoader::new([("a.urdf", robot)]);
            let source = sources.add(format!("b.{}", language.extension), text);
            let found = check(language, &mut sources, &loader, source);
            all += &render(&sources, &found, Format::Short);
        }
    }
    expect![[r#"
        b.idsl:2:24: error[duplicate-name]: member `a` is declared twice; first declared here at b.idsl:2:17
        b.idsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.idsl:2:14: error[duplicate-name]: enumerator `x` is declared twice; first declared here at b.idsl:2:11
        b.idsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.cdsl:2:30: error[unknown-language]: unknown language `klingon` (expected one of `rust`, `cpp`, `python`, `cpp11`, `cpp17`, `c++`)
        b.cdsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.cdsl:2:43: error[unknown-interface]: unknown interface `Nobody` (import the file that declares it; `import "Nobody.idsl";` finds no file)
        b.cdsl:3:12: error[syntax-error]: expected `}`, found the end of the file
        b.pdsl:2:4: error[unknown-type]: unknown type `itn` (did you mean `int`?)
        b.pdsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.pdsl:3:8: error[bad-range]: this range is empty: its end is below its start
        b.pdsl:3:12: error[syntax-error]: expected `}`, found the end of the file
        b.smdsl:2:12: error[duplicate-state]: state `a` is declared twice; first declared here at b.smdsl:2:9
        b.smdsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.smdsl:3:1: error[syntax-error]: expected `,` or `;`, found the end of the file
        b.ddsl:2:39: error[unknown-restart]: unknown restart policy `sometimes` (expected one of `never`, `on_failure`, `always`)
        b.ddsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.ddsl:2:39: error[unknown-restart]: unknown restart policy `sometimes` (expected one of `never`, `on_failure`, `always`)
        b.ddsl:2:56: error[unknown-instance]: unknown component or group `b` (expected `a`)
        b.ddsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.gdsl:2:15: error[unknown-type]: unknown type `itn` (did you mean `int`?)
        b.gdsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        b.gdsl:2:15: error[unknown-type]: unknown type `itn` (did you mean `int`?)
        b.gdsl:3:1: error[syntax-error]: expected `,`, `;` or `unit`, `key`, `optional`, `history`, `consistency` or a range, found the end of the file
        b.dproto:1:1: error[bad-axes]: expected the directions of x, y and z along three lines, as in `ahead, left, up`; there are ahead, back, left, right, up and down
        b.dproto:2:13: error[unknown-domain]: unknown domain `b` (expected `geometry`)
        b.dproto:4:1: error[syntax-error]: expected `}`, found the end of the file
        b.dproto:1:1: error[bad-axes]: expected the directions of x, y and z along three lines, as in `ahead, left, up`; there are ahead, back, left, right, up and down
        b.dproto:4:1: error[syntax-error]: expected `}`, found the end of the file
        b.kdsl:3:18: error[unknown-link]: the robot `r` has no link `tip` (expected `base`)
        b.kdsl:3:41: error[duplicate-name]: `s` is declared twice, or has the type of another one; first declared here at b.kdsl:3:9
        b.kdsl:4:1: error[syntax-error]: expected `}`, found the end of the file
        b.kdsl:3:9: error[empty-solver]: the solver `s` gives nothing (write what it computes, such as `pose TIP in BASE;`)
        b.kdsl:3:13: error[without-effect]: `iterations` changes nothing: this solver is not an inverse
        b.kdsl:3:27: error[duplicate-name]: `iterations` occurs twice; first declared here at b.kdsl:3:13
        b.kdsl:4:1: error[syntax-error]: expected `}`, found the end of the file
    "#]].assert_eq(&all);
}

/// A short run of `cargo xtask fuzz`.
#[test]
fn no_text_causes_a_panic() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let seconds = number("RC_FUZZ_SECONDS").map(Duration::from_secs);
    let first = number("RC_FUZZ_SEED").unwrap_or(0);
    let grammars = LANGUAGES.map(grammar_of);
    let started = Instant::now();
    let mut texts = 0_u64;
    for seed in first.. {
        let over = seconds.map_or(seed - first >= 150, |limit| started.elapsed() > limit);
        if over {
            break;
        }
        for (language, grammar) in LANGUAGES.into_iter().zip(&grammars) {
            let mut random = Random::new(seed);
            let other = random.one_of(&grammars).words(&mut random);
            let bytes = spoil(grammar.words(&mut random), &other, &mut random);
            let text = String::from_utf8_lossy(&bytes);
            if seconds.is_some() {
                // A stack overflow ends the process without a message; the last line names the
                // seed.
                println!("RC_FUZZ_SEED={seed} .{}", language.extension);
            }
            let done = std::panic::catch_unwind(|| process(language, &text));
            assert!(
                done.is_ok(),
                "RC_FUZZ_SEED={seed}, .{}:\n{text}",
                language.extension
            );
            texts += 1;
        }
    }
    println!("{texts} texts, seeds from {first}");
}

/// A text of eight times the length takes about eight times as long, whether or not it has errors.
#[test]
fn time_is_linear_in_the_length() {
    for language in LANGUAGES {
        let grammar = grammar_of(language);
        let mut random = Random::new(7);
        let valid = (0..200)
            .map(|_| grammar.words(&mut random))
            .filter(|words| !tree(language, &words.join(" ")).1)
            .max_by_key(Vec::len)
            .expect("a valid text");
        let open = valid.iter().position(|w| w == "{").expect("a block");
        let (head, body) = valid.split_at(open + 1);
        let body = body[..body.iter().rposition(|w| w == "}").expect("its end")].join(" ");
        let of_length = |length: usize, spoilt: bool| {
            let mut text = head.join(" ");
            while text.len() < length {
                text.push_str(&body);
                text.push_str(if spoilt {
                    "\n} ] = ;; x\n{ /** */ \"\n"
                } else {
                    "\n"
                });
            }
            text + "}"
        };
        for spoilt in [false, true] {
            let time = |length| {
                let text = of_length(length, spoilt);
                let started = Instant::now();
                process(language, &text);
                started.elapsed()
            };
            let (short, long) = (time(1 << 14), time(1 << 17));
            assert!(
                long < short * 30 + Duration::from_millis(200),
                ".{}, spoilt: {spoilt}: 16 KiB {short:?}, 128 KiB {long:?}",
                language.extension
            );
        }
    }
}

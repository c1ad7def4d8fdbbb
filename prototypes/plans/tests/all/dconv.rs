//! Emitted C beside that of dconv, the tool of the paper: its tests hold what it prints.

use crate::functions::{compile, written};
use crate::library;
use rc_plans::{Network, c};
use rc_prototypes::model::Library;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::Command;

/// A conversion of a test of dconv.
struct Printed {
    from: String,
    to: String,
    /// The prefixes of the members of the source and of the target.
    source: String,
    target: String,
    statements: String,
}

/// The text between two texts, and the rest.
fn between<'t>(text: &'t str, open: &str, close: &str) -> Option<(&'t str, &'t str)> {
    let (_, rest) = text.split_once(open)?;
    rest.split_once(close)
}

/// The words in single quotes.
fn quoted(text: &str) -> Vec<&str> {
    text.split('\'').skip(1).step_by(2).collect()
}

/// The conversions of a test: the pairs that it converts, and the output that it expects of each.
fn printed(test: &str) -> Vec<Printed> {
    let mut all = Vec::new();
    for block in test.split(" it('").skip(1) {
        let Some((statements, _)) = between(block, "[[", "]]") else {
            continue;
        };
        let call = block.lines().find(|line| line.contains("(str,'"));
        let ends: Vec<&str> = quoted(call.expect("a call"));
        // Where values are between both, the tool takes one for the other.
        let is_swapped = statements.contains("_tmp_");
        let (source, target) = if is_swapped {
            (ends[1], ends[0])
        } else {
            (ends[0], ends[1])
        };
        let lines = block
            .lines()
            .filter(|line| line.trim().starts_with("{'") || line.contains("dconv.convert('"));
        for pair in lines.map(quoted).filter(|pair| pair.len() == 2) {
            all.push(Printed {
                from: pair[0].to_owned(),
                to: pair[1].to_owned(),
                source: source.trim_end_matches('.').to_owned(),
                target: target.trim_end_matches('.').to_owned(),
                statements: statements.to_owned(),
            });
        }
    }
    all
}

/// The members of a prototype, in the order of its numbers, as dconv names them but for brackets.
fn members(library: &Library, name: &str) -> Vec<String> {
    let of = library.prototype(name).expect("a prototype");
    let numbers = library.numbers(of).expect("numbers");
    numbers.into_iter().map(|number| number.member).collect()
}

/// `position.data.arr[0]` as `position.0`, `(0,1)` as `{0,1}`.
fn path(text: &str) -> String {
    let text = text.replace("data.arr[", "[").replace("im.arr[", "im[");
    let mut out = String::new();
    for part in text.split_inclusive([')', ']']) {
        out += &match part.split_once(['(', '[']) {
            Some((name, index)) => {
                let index = index.trim_end_matches([')', ']']);
                let index = if index.contains(',') {
                    format!("{{{index}}}")
                } else {
                    index.to_owned()
                };
                format!("{name}.{index}")
            }
            None => part.to_owned(),
        };
    }
    out.replace("..", ".").trim_matches('.').to_owned()
}

/// These statements over `from` and `to`, whose numbers are in our order.
fn renamed(library: &Library, of: &Printed) -> String {
    let (own, wanted) = (members(library, &of.from), members(library, &of.to));
    let ends = [("from", &of.source, &own), ("to", &of.target, &wanted)];
    let number = |text: &str| -> String {
        for (array, prefix, members) in &ends {
            let Some(rest) = text.strip_prefix(prefix.as_str()) else {
                continue;
            };
            let path = path(rest);
            let at = members.iter().position(|member| *member == path);
            return format!(
                "{array}[{}]",
                at.unwrap_or_else(|| panic!("{text} in {members:?}"))
            );
        }
        assert!(text.contains("_tmp_"), "{text}");
        text.to_owned()
    };
    // All numbers of an object, which a function takes: copied there and back.
    let object = |text: &str| -> (String, String, usize, bool) {
        for (array, prefix, members) in &ends {
            let Some(rest) = text.strip_prefix(prefix.as_str()) else {
                continue;
            };
            let path = path(rest);
            let begins =
                |member: &&String| path.is_empty() || member.starts_with(&format!("{path}."));
            let first = members
                .iter()
                .position(|member| begins(&member))
                .expect("a member");
            let count = members.iter().filter(begins).count();
            return (
                (*array).to_owned(),
                format!("{array} + {first}"),
                count,
                true,
            );
        }
        (text.to_owned(), text.to_owned(), 0, false)
    };
    let mut out = String::new();
    for line in of.statements.lines().map(str::trim) {
        if let Some((arguments, _)) = between(line, "quat2rot(", ")") {
            let (one, other) = arguments.split_once(',').expect("two");
            let (one, other) = (object(one.trim()), object(other.trim()));
            assert!(one.2 % 4 == 0 && other.2 % 9 == 0, "{line}");
            writeln!(out, "    quat2rot({}, {});", one.1, other.1).expect("a text");
        } else if let Some((left, right)) = line.split_once(" = ") {
            let right = right.trim_end_matches(';');
            writeln!(out, "    {} = {};", number(left), number(right)).expect("a text");
        } else {
            writeln!(out, "    {line}").expect("a text");
        }
    }
    out
}

/// The function that the tests of dconv declare, and none of its files defines.
const QUAT2ROT: &str = "static void quat2rot(const double *q, double *r)
{
    double x = q[0], y = q[1], z = q[2], w = q[3];
    r[0] = 1 - 2 * (y * y + z * z); r[1] = 2 * (x * y - z * w); r[2] = 2 * (x * z + y * w);
    r[3] = 2 * (x * y + z * w); r[4] = 1 - 2 * (x * x + z * z); r[5] = 2 * (y * z - x * w);
    r[6] = 2 * (x * z - y * w); r[7] = 2 * (y * z + x * w); r[8] = 1 - 2 * (x * x + y * y);
}
";

/// Fills `from` with random numbers, each quaternion of length 1 and each matrix a rotation, and compares.
const MAIN: &str = "
static double random_number(void) { return 2.0 * rand() / RAND_MAX - 1.0; }
static void turn(double *q)
{
    double length = 0;
    for (int at = 0; at < 4; at++) { q[at] = random_number(); length += q[at] * q[at]; }
    for (int at = 0; at < 4; at++) q[at] /= sqrt(length);
}
int main(void)
{
    for (int number = 0; number < COUNT; number++) {
        const struct conversion *of = &all[number];
        for (int times = 0; times < 1000; times++) {
            double from[32], theirs[32] = {0}, ours[32] = {0};
            for (int at = 0; at < 32; at++) from[at] = random_number();
            for (const char *part = of->parts; *part; part++) {
                double *begin = from + part[1] - 'A';
                if (*part == 'q') turn(begin);
                if (*part == 'r') { double q[4]; turn(q); quat2rot(q, begin); }
                part++;
            }
            of->theirs(from, theirs);
            if (of->ours(from, ours)) { printf(\"%s: refused\\n\", of->name); return 1; }
            for (int at = 0; at < of->count; at++)
                if (!(fabs(theirs[at] - ours[at]) <= of->limit)) {
                    printf(\"%s: %d: %.17g %.17g\\n\", of->name, at, theirs[at], ours[at]);
                    return 1;
                }
        }
    }
    printf(\"%d\\n\", COUNT);
    return 0;
}
";

/// Where the quaternions and matrices of a prototype begin: `q` and `r`, each with a letter.
fn parts(library: &Library, name: &str, first: u8, out: &mut String) -> u8 {
    use rc_prototypes::model::Content;
    let of = library.prototype(name).expect("a prototype");
    match &of.content {
        Content::Values {
            coordinate, data, ..
        } => {
            match coordinate.as_str() {
                "quaternion" => out.push_str(&format!("q{}", char::from(b'A' + first))),
                "rot_matrix" => out.push_str(&format!("r{}", char::from(b'A' + first))),
                _ => {}
            }
            first + u8::try_from(data.len()).expect("few")
        }
        Content::Parts(all) => all.iter().fold(first, |first, part| {
            parts(library, &part.prototype, first, out)
        }),
    }
}

/// The files of dconv are in the folder `dproto` that `RC_REAL_FILES` names: `test2.dproto` beside
/// `test2.lua`. Both functions are compiled, and take 1,000 random values each.
#[test]
fn emitted_c_gives_the_numbers_of_dconv() {
    let test = "emitted_c_gives_the_numbers_of_dconv";
    let folder = std::env::var_os("RC_REAL_FILES").map(|own| PathBuf::from(own).join("dproto"));
    let read = |name: &str| std::fs::read_to_string(folder.as_deref()?.join(name)).ok();
    let (mut functions, mut table, mut count) = (String::from(QUAT2ROT), String::new(), 0);
    for name in ["test1", "test2", "test3", "test4", "test6"] {
        let files = read(&format!("{name}.dproto")).zip(read(&format!("{name}.lua")));
        let Some((text, script)) = files else {
            continue;
        };
        let library = library(&text);
        let network = Network::new(&library);
        for of in printed(&script) {
            let own = network.plan(&of.from, &of.to).expect("a plan");
            let number = count;
            let ours = c(&own);
            let called = format!("{}_to_{}", of.from, of.to);
            let ours = ours.replace(&called, &format!("ours{number}"));
            writeln!(
                functions,
                "{ours}\nstatic void theirs{number}(const double *from, double *to)\n{{\n{}}}\n",
                renamed(&library, &of)
            )
            .expect("a text");
            let mut which = String::new();
            parts(&library, &of.from, 0, &mut which);
            let limit = if of.statements.contains("quat2rot") {
                "1e-14"
            } else {
                "0"
            };
            writeln!(table, "    {{ \"{name}: {called}\", theirs{number}, ours{number}, {}, {limit}, \"{which}\" }},", own.program.outputs()).expect("a text");
            count += 1;
        }
    }
    if count == 0 {
        rc_test_support::python::skipped(test, "RC_REAL_FILES has no tests of dconv");
        return;
    }
    let text = format!(
        "#include <math.h>\n#include <stdint.h>\n#include <stdio.h>\n#include <stdlib.h>\n{functions}\n\
         struct conversion {{ const char *name; void (*theirs)(const double *, double *); int (*ours)(const double *, double *); int count; double limit; const char *parts; }};\n\
         static const struct conversion all[] = {{\n{table}}};\n#define COUNT {count}\n{MAIN}"
    );
    let place = tempfile::tempdir().expect("a folder");
    let source = written(place.path(), "both.c", &text);
    let program = compile(
        Command::new("cc")
            .args(["-std=c99", "-ffp-contract=off", "-O1"])
            .arg(source)
            .arg("-lm"),
        place.path(),
    );
    let ran = Command::new(program).output().expect("it runs");
    assert!(ran.status.success(), "{ran:?}");
    assert_eq!(
        String::from_utf8_lossy(&ran.stdout).trim(),
        count.to_string()
    );
    println!("{count} conversions of dconv");
}

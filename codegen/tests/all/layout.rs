//! `codegen::layout` breaks lines where rustfmt does: many statements of random lengths, and rustfmt's own opinion.

use rc_codegen::layout;
use std::process::Command;

/// Numbers that are the same in every run (xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 33).expect("31 bits") % end
    }

    /// A name of up to `length` letters.
    fn name(&mut self, length: usize) -> String {
        let length = 1 + self.below(length);
        "abcdefghijklmnopqrstuvwxyz"[..length.min(26)].repeat(1 + length / 27)
    }

    fn names(&mut self, count: usize, length: usize) -> Vec<String> {
        let count = self.below(count) + 1;
        (0..count).map(|_| self.name(length)).collect()
    }
}

/// Prints `count` items, and compares with what rustfmt makes of them.
fn check(count: usize, mut item: impl FnMut(&mut Random) -> String) {
    let mut random = Random(0x5EED);
    let items: Vec<String> = (0..count).map(|_| item(&mut random)).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("items.rs");
    let text = items.join("\n\n") + "\n";
    std::fs::write(&file, &text).expect("a file");
    let output = Command::new("rustfmt")
        .args(["--edition", "2024", "--check"])
        .arg(&file)
        .output()
        .expect("rustfmt starts");
    let told = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    let first: Vec<&str> = told.lines().take(60).collect();
    assert!(output.status.success(), "{}\n{error}", first.join("\n"));
}

#[test]
fn signatures() {
    check(600, |random| {
        let mut args = vec!["&mut self".to_owned(), "ctx: &mut Context".to_owned()];
        let more = random.names(3, 20);
        args.extend(more.into_iter().map(|name| format!("{name}: {name}")));
        let head = format!("fn {}", random.name(26));
        let result = match random.below(3) {
            0 => String::new(),
            _ => format!(" -> Result<{}, {}>", random.name(26), random.name(26)),
        };
        match random.below(3) {
            0 => {
                let one = layout::signature(4, &head, &args, &format!("{result};"));
                format!("trait T {{\n    {one}\n}}")
            }
            1 => {
                let one = layout::signature(4, &head, &args, &format!("{result} {{"));
                format!("impl T {{\n    {one}\n        x;\n    }}\n}}")
            }
            _ => {
                args.remove(0);
                let one = layout::signature(0, &head, &args, &format!("{result} {{"));
                format!("{one}\n    x;\n}}")
            }
        }
    });
}

#[test]
fn calls() {
    check(600, |random| {
        let length = [6, 12, 26][random.below(3)];
        let args = random.names(9, length);
        let head = random.name(20);
        match random.below(3) {
            0 => {
                let one = layout::call(4, &head, &args, ["?;", ";"][random.below(2)]);
                format!("fn f() {{\n    {one}\n}}")
            }
            1 => {
                let answer = ["answer".to_owned()];
                let one = layout::binding(4, &answer, &format!("worker.{head}"), &args, ";");
                format!("fn f() {{\n    {one}\n}}")
            }
            _ => {
                let args = ["&mut self.worker", "&mut self.ctx", "request"].map(str::to_owned);
                let one = layout::call(12, &format!("1 => slots::{head}::serve"), &args, ",");
                format!(
                    "impl T {{\n    fn f() {{\n        match x {{\n            {one}\n        }}\n    }}\n}}"
                )
            }
        }
    });
}

#[test]
fn tuples() {
    check(600, |random| {
        let length = [6, 12, 26][random.below(3)];
        let mut items = random.names(8, length);
        items.push(random.name(9));
        match random.below(5) {
            4 => {
                let head = format!("in_place::{}", random.name(26));
                let args = random.names(4, 20);
                let one = layout::binding(4, &items[..=random.below(2)], &head, &args, "?;");
                format!("fn f() {{\n    {one}\n}}")
            }
            0 => {
                let head = format!("pub type {}", random.name(26));
                layout::tuple_alias(&head, &items)
            }
            1 => {
                let head = format!("pub(crate) fn {}", random.name(26));
                let one =
                    layout::tuple_result(&head, "reader: &mut Reader<'_>", &items, "DecodeError");
                format!("{one}\n    x;\n}}")
            }
            2 => {
                let head = format!("request.{}", random.name(12));
                let args = random.names(2, 26);
                let one = layout::binding(4, &items, &head, &args, "?;");
                format!("fn f() {{\n    {one}\n}}")
            }
            _ => {
                let one = layout::call(4, "", &items, "");
                format!("fn f() {{\n    Ok({one})\n}}")
            }
        }
    });
}

#[test]
fn lists() {
    check(400, |random| {
        let length = [6, 12, 26][random.below(3)];
        let mut items = random.names(20, length);
        match random.below(3) {
            0 => {
                items.sort();
                items.dedup();
                layout::imports(&random.name(20), &items)
            }
            1 => layout::constant("pub(crate) const OPERATIONS: &[Operation]", &items),
            _ => {
                let array = layout::array_in(4, &items);
                format!(
                    "static D: Description = Description {{\n    slots: {array},\n    x: a_value_that_is_long,\n}};"
                )
            }
        }
    });
}

#[test]
fn chains() {
    check(200, |random| {
        let name = random.name(26);
        let calls = [
            format!(".list({:?})", random.name(26)),
            ".iter()".to_owned(),
            format!(".map({}::from_values)", random.name(26)),
            ".collect()".to_owned(),
        ];
        let calls: Vec<&str> = calls.iter().map(String::as_str).collect();
        let one = layout::chain(12, name.len() + 2, "values", &calls);
        format!(
            "impl T {{\n    fn f() {{\n        Self {{\n            {name}: {one},\n            more,\n        }}\n    }}\n}}"
        )
    });
}

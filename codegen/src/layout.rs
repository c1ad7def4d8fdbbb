//! Where rustfmt would break a line. Generated code is as rustfmt leaves it, without needing rustfmt.
//!
//! The limits are rustfmt's defaults: lines of 100 characters, arguments of a call of 60.

const LINE: usize = 100;
const CALL: usize = 60;

/// `HEAD(A, B)TAIL` on one line if it fits, else one argument a line. `indent` counts spaces.
pub fn signature(indent: usize, head: &str, args: &[String], tail: &str) -> String {
    let one = format!("{head}({}){tail}", args.join(", "));
    if indent + one.len() <= LINE {
        one
    } else {
        broken(indent, head, args, tail)
    }
}

/// A call as a statement: like a signature, but its arguments are also short.
pub fn call(indent: usize, head: &str, args: &[String], tail: &str) -> String {
    let width = args.join(", ").len();
    let one = format!("{head}({}){tail}", args.join(", "));
    if width <= CALL && indent + one.len() <= LINE {
        one
    } else {
        broken(indent, head, args, tail)
    }
}

fn broken(indent: usize, head: &str, args: &[String], tail: &str) -> String {
    let pad = " ".repeat(indent);
    let lines: String = args
        .iter()
        .map(|arg| format!("{pad}    {arg},\n"))
        .collect();
    format!("{head}(\n{lines}{pad}){tail}")
}

/// An array that is not indented.
pub fn array(items: &[String]) -> String {
    array_in(0, items)
}

/// An array: on one line up to 60 characters; else short items fill lines and others have a line each.
pub fn array_in(indent: usize, items: &[String]) -> String {
    const SHORT: usize = 10;
    let one = items.join(", ");
    if one.len() <= CALL {
        return format!("&[{one}]");
    }
    let pad = " ".repeat(indent);
    let mut lines: Vec<String> = Vec::new();
    for item in items {
        match lines.last_mut() {
            Some(last)
                if items.iter().all(|i| i.len() <= SHORT)
                    && last.len() + item.len() + 2 <= LINE =>
            {
                last.push(' ');
                last.push_str(item);
                last.push(',');
            }
            _ => lines.push(format!("{pad}    {item},")),
        }
    }
    format!("&[\n{}\n{pad}]", lines.join("\n"))
}

/// A documentation comment, one line each.
pub fn doc(lines: &[String]) -> Vec<String> {
    lines
        .iter()
        .map(|line| {
            if line.is_empty() {
                "///".to_owned()
            } else {
                format!("/// {}", line.trim_end())
            }
        })
        .collect()
}

/// `use KRATE::{A, B};` as rustfmt lays it out: as many names a line as fit.
pub fn imports(krate: &str, names: &[String]) -> String {
    if let [one] = names {
        return format!("use {krate}::{one};");
    }
    let line = format!("use {krate}::{{{}}};", names.join(", "));
    if line.len() <= LINE {
        return line;
    }
    let mut lines: Vec<String> = Vec::new();
    for name in names {
        match lines.last_mut() {
            Some(last) if last.len() + name.len() + 2 <= LINE => {
                last.push(' ');
                last.push_str(name);
                last.push(',');
            }
            _ => lines.push(format!("    {name},")),
        }
    }
    format!("use {krate}::{{\n{}\n}};", lines.join("\n"))
}

//! Statements that check bounds and ranges where values are written and read.

use crate::layout;
use rc_idsl::Library;
use rc_idsl::model::{Member, Primitive, Type};
use rc_syntax::{Literal, LiteralKind};

/// Where a check stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Before writing, on `writer`.
    Write,
    /// After reading, on `reader`.
    Read,
}

/// The statements for one member or parameter, each beginning without indentation; those inside functions
/// stand eight spaces deep. `place` is the expression that holds the value.
pub(super) fn lines(
    library: &Library,
    member: &Member,
    what: &str,
    place: &str,
    side: Side,
) -> Vec<String> {
    lines_at(library, member, what, place, side, 8)
}

/// The same, `indent` spaces deep.
pub(super) fn lines_at(
    library: &Library,
    member: &Member,
    what: &str,
    place: &str,
    side: Side,
    indent: usize,
) -> Vec<String> {
    let mut out = Vec::new();
    let mut writer = Lines {
        library,
        member,
        what,
        side,
        out: &mut out,
    };
    if member.optional {
        let mut inner = Vec::new();
        Lines {
            out: &mut inner,
            ..writer
        }
        .of(&member.ty, "item", true, indent + 4);
        if !inner.is_empty() {
            out.push(format!("if let Some(item) = &{place} {{"));
            out.extend(inner.into_iter().map(|line| format!("    {line}")));
            out.push("}".to_owned());
        }
    } else {
        writer.of(&member.ty, place, false, indent);
    }
    out
}

/// "0 to 100", "at least 0", for documentation and messages.
pub(crate) fn range_text(member: &Member) -> Option<String> {
    let range = member.range.as_ref()?;
    let text = |literal: &Literal| literal.as_f64().map_or(String::new(), |v| v.to_string());
    Some(match (&range.min, &range.max) {
        (Some(min), Some(max)) => format!("{} to {}", text(min), text(max)),
        (Some(min), None) => format!("at least {}", text(min)),
        (None, Some(max)) => format!("at most {}", text(max)),
        (None, None) => return None,
    })
}

struct Lines<'a> {
    library: &'a Library,
    member: &'a Member,
    what: &'a str,
    side: Side,
    out: &'a mut Vec<String>,
}

impl Lines<'_> {
    fn of(&mut self, ty: &Type, place: &str, by_reference: bool, indent: usize) {
        match self.library.resolved(ty) {
            Type::Primitive(primitive) => self.range(*primitive, place, by_reference, indent),
            Type::String(Some(bound)) => self.bound(place, *bound, indent),
            Type::Sequence(element, bound) => {
                if let Some(bound) = bound {
                    self.bound(place, *bound, indent);
                }
                self.each(element, place, by_reference, indent);
            }
            Type::Array(element, _) => self.each(element, place, by_reference, indent),
            Type::Dictionary(key, value) => {
                for (element, entries) in [(key, "keys"), (value, "values")] {
                    self.each(element, &format!("{place}.{entries}()"), true, indent);
                }
            }
            // Members of a structure are checked where the structure is written.
            Type::String(None) | Type::Named(_) => {}
        }
    }

    /// Bounds inside of elements; ranges of elements are not scanned.
    fn each(&mut self, element: &Type, place: &str, by_reference: bool, indent: usize) {
        if matches!(self.library.resolved(element), Type::Primitive(_)) {
            return;
        }
        let mut inner = Vec::new();
        let mut lines = Lines {
            out: &mut inner,
            library: self.library,
            member: self.member,
            ..*self
        };
        lines.of(element, "item", true, indent + 4);
        if !inner.is_empty() {
            let borrow = if by_reference { "" } else { "&" };
            self.out.push(format!("for item in {borrow}{place} {{"));
            self.out
                .extend(inner.into_iter().map(|line| format!("    {line}")));
            self.out.push("}".to_owned());
        }
    }

    fn bound(&mut self, place: &str, bound: u32, indent: usize) {
        let (port, end) = self.port();
        let args = [
            format!("{:?}", self.what),
            format!("{place}.len()"),
            bound.to_string(),
        ];
        self.push(&format!("{port}.bound"), &args, end, indent);
    }

    fn range(&mut self, primitive: Primitive, place: &str, by_reference: bool, indent: usize) {
        let (Some(range), Some(text)) = (&self.member.range, range_text(self.member)) else {
            return;
        };
        let end = |literal: &Option<Literal>, none: &str| match literal {
            Some(Literal {
                kind: LiteralKind::Int(value),
                ..
            }) => format!("{value}.0"),
            Some(Literal {
                kind: LiteralKind::Float(value),
                ..
            }) => format!("{value:?}"),
            _ => none.to_owned(),
        };
        let value = if by_reference {
            format!("*{place}")
        } else {
            place.to_owned()
        };
        let value = match primitive {
            Primitive::F64 => value,
            Primitive::I64 | Primitive::U64 => format!("{value} as f64"),
            _ => format!("f64::from({value})"),
        };
        let limits = format!(
            "({}, {})",
            end(&range.min, "f64::NEG_INFINITY"),
            end(&range.max, "f64::INFINITY")
        );
        let (port, tail) = self.port();
        let args = [
            format!("{:?}", self.what),
            value,
            limits,
            format!("{text:?}"),
        ];
        self.push(&format!("{port}.range"), &args, tail, indent);
    }

    fn port(&self) -> (&'static str, &'static str) {
        match self.side {
            Side::Write => ("writer", ";"),
            Side::Read => ("reader", "?;"),
        }
    }

    /// Lines of one statement, each without the indentation that the template gives.
    fn push(&mut self, head: &str, args: &[String], tail: &str, indent: usize) {
        let pad = " ".repeat(indent);
        let text = layout::call(indent, head, args, tail);
        self.out.extend(
            text.lines()
                .map(|line| line.strip_prefix(&pad).unwrap_or(line).to_owned()),
        );
    }
}

//! The values of an element's attributes.

use crate::elements::Element;
use crate::model::Axis;
use crate::units::Units;
use rc_diagnostics::{Diagnostic, Diagnostics, Name, Span};
use rc_xml::XmlSource;
use roxmltree::Node;

/// The attributes of one element. A missing one has its default; a wrong one is reported.
pub(crate) struct Attributes<'a, 'd> {
    text: XmlSource<'a>,
    tag: Span,
    values: Vec<(&'static str, Name)>,
    units: Units,
    found: &'d mut Diagnostics,
}

impl<'a, 'd> Attributes<'a, 'd> {
    /// Reads the attributes of `node`, and reports those that `element` does not have.
    pub(crate) fn read(
        text: XmlSource<'a>,
        node: Node<'_, '_>,
        element: &Element,
        units: Units,
        found: &'d mut Diagnostics,
    ) -> Self {
        let mut values: Vec<(&'static str, Name)> = Vec::new();
        for attribute in node.attributes() {
            let span = text.attribute_name(&attribute);
            let name = attribute.name();
            let known = element.attributes().find(|a| a.contains(&name));
            let Some(known) = known.filter(|_| attribute.namespace().is_none()) else {
                let all = element.attributes().map(|names| names[0]);
                let message = format!(
                    "unknown attribute `{}` of `{}`",
                    text.slice(span),
                    element.tag
                );
                found
                    .push(Diagnostic::error("unknown-attribute", span, message).suggest(name, all));
                continue;
            };
            if let Some((_, first)) = values.iter().find(|(other, _)| *other == known[0]) {
                let message = format!("`{name}` sets what another attribute has set already");
                found.push(
                    Diagnostic::error("repeated-attribute", span, message)
                        .label(first.span, "first set here"),
                );
                continue;
            }
            values.push((known[0], text.attribute_value(&attribute)));
        }
        Self {
            text,
            tag: text.tag(node),
            values,
            units,
            found,
        }
    }

    /// Reports a finding.
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        self.found.push(diagnostic);
    }

    /// The value of an attribute, by the first of its spellings.
    pub(crate) fn value(&self, name: &str) -> Option<&Name> {
        let mut all = self.values.iter();
        all.find(|(n, _)| *n == name).map(|(_, value)| value)
    }

    /// A text; empty if it is missing.
    pub(crate) fn text(&self, name: &str) -> String {
        self.value(name)
            .map_or_else(String::new, |v| v.text.clone())
    }

    /// Words, separated by white space or commas.
    pub(crate) fn words(&self, name: &str) -> Vec<Name> {
        let Some(value) = self.value(name) else {
            return Vec::new();
        };
        let mut spaced = value.clone();
        spaced.text = spaced.text.replace(',', " ");
        // A comma is as long as a space, so locations stay.
        let as_written = self.text.slice(value.span) == value.text;
        let start = spaced.text.as_ptr() as usize;
        spaced
            .text
            .split_whitespace()
            .map(|word| {
                let at = value.span.start + (word.as_ptr() as usize - start);
                let span = Span::new(value.span.source, at, at + word.len());
                Name::new(word, if as_written { span } else { value.span })
            })
            .collect()
    }

    fn bad_number(&mut self, name: &str, value: &Name, expected: &str) {
        let mut diagnostic = Diagnostic::error(
            "bad-number",
            value.span,
            format!("expected {expected} for `{name}`, found `{}`", value.text),
        );
        let swapped = value.text.replace(',', ".");
        if swapped != value.text && swapped.trim().parse::<f64>().is_ok() {
            diagnostic = diagnostic.help(format!("write `{}`", swapped.trim()));
        }
        self.push(diagnostic);
    }

    /// A number without a unit, or an angle.
    pub(crate) fn number(&mut self, name: &str, default: f64) -> f64 {
        let Some(value) = self.value(name).cloned() else {
            return default;
        };
        if let Some(number) = finite(&value.text) {
            return number;
        }
        self.bad_number(name, &value, "a number");
        default
    }

    /// A length in millimetres.
    pub(crate) fn length(&mut self, name: &str, default: f64) -> f64 {
        if self.value(name).is_none() {
            return default;
        }
        let written = self.number(name, f64::NAN);
        if written.is_nan() {
            return default;
        }
        self.millimetres(name, written, default)
    }

    /// A length in millimetres. One that is finite in metres only is reported.
    fn millimetres(&mut self, name: &str, written: f64, default: f64) -> f64 {
        let length = self.units.length(written);
        if !length.is_finite()
            && let Some(value) = self.value(name).cloned()
        {
            self.bad_number(name, &value, "a finite length");
            return default;
        }
        length
    }

    /// A number that meets a condition; if it does not, it is reported.
    fn checked(&mut self, name: &str, default: f64, is_right: fn(f64) -> bool, rule: &str) -> f64 {
        let number = self.number(name, default);
        if !is_right(number)
            && let Some(value) = self.value(name).cloned()
        {
            let message = format!("`{name}` {rule}, found `{}`", value.text);
            self.push(Diagnostic::error("bad-value", value.span, message));
            return default;
        }
        number
    }

    /// A number of at least 0.
    pub(crate) fn at_least_0(&mut self, name: &str, default: f64) -> f64 {
        self.checked(name, default, |n| n >= 0.0, "cannot be negative")
    }

    /// A length of at least 0, in millimetres.
    pub(crate) fn length_at_least_0(&mut self, name: &str, default: f64) -> f64 {
        if self.value(name).is_none() {
            return default;
        }
        let written = self.at_least_0(name, f64::NAN);
        if written.is_nan() {
            default
        } else {
            self.millimetres(name, written, default)
        }
    }

    /// A number greater than 0.
    pub(crate) fn positive(&mut self, name: &str, default: f64) -> f64 {
        self.checked(name, default, |n| n > 0.0, "must be greater than 0")
    }

    /// A number of pixels, 0 if it is missing.
    pub(crate) fn pixels(&mut self, name: &str) -> f64 {
        let is_whole = |n: f64| n >= 1.0 && n.fract() == 0.0;
        self.checked(name, 0.0, is_whole, "must be a whole number from 1")
    }

    /// A number from 0 to 1.
    pub(crate) fn part(&mut self, name: &str, default: f64) -> f64 {
        let is_part = |n| (0.0..=1.0).contains(&n);
        self.checked(name, default, is_part, "must be from 0 to 1")
    }

    /// Points as `x,z x,z …`, in millimetres.
    pub(crate) fn path(&mut self, name: &str) -> Vec<[f64; 2]> {
        let Some(value) = self.value(name).cloned() else {
            return Vec::new();
        };
        let units = self.units;
        let point = |word: &str| {
            let (x, z) = word.split_once(',')?;
            let point = [finite(x)?, finite(z)?].map(|number| units.length(number));
            point.iter().all(|n| n.is_finite()).then_some(point)
        };
        let points: Option<Vec<_>> = value.text.split_whitespace().map(point).collect();
        points.unwrap_or_else(|| {
            self.bad_number(name, &value, "points such as `0,0 1000,500`");
            Vec::new()
        })
    }

    /// A length that must be greater than 0.
    pub(crate) fn positive_length(&mut self, name: &str) -> f64 {
        let Some(value) = self.value(name).cloned() else {
            let message = format!("the attribute `{name}` is missing");
            self.push(Diagnostic::error("missing-attribute", self.tag, message));
            return 1.0;
        };
        let length = self.length(name, 1.0);
        if length > 0.0 {
            return length;
        }
        let message = format!("`{name}` must be greater than 0, found `{}`", value.text);
        self.push(Diagnostic::error("bad-value", value.span, message));
        1.0
    }

    /// `min` and `max`: missing and infinite ones are not limits.
    pub(crate) fn limits(&mut self, length: bool) -> (f64, f64) {
        let units = self.units;
        let mut limit = |name: &str, none: f64| {
            let Some(value) = self.value(name).cloned() else {
                return none;
            };
            match value.text.trim().parse::<f64>() {
                Ok(number) if number.is_nan() => {}
                Ok(number) if length => {
                    let limit = units.length(number);
                    if limit.is_finite() || number.is_infinite() {
                        return limit;
                    }
                }
                Ok(number) => return number,
                Err(_) => {}
            }
            self.bad_number(name, &value, "a number or `inf`");
            none
        };
        let (min, max) = (limit("min", f64::NEG_INFINITY), limit("max", f64::INFINITY));
        let wrong = [
            ("min", min > max, "`min` is greater than `max`"),
            ("min", min == f64::INFINITY, "`min` cannot be `inf`"),
            ("max", max == f64::NEG_INFINITY, "`max` cannot be `-inf`"),
        ];
        if let Some((name, _, message)) = wrong.into_iter().find(|(_, is_wrong, _)| *is_wrong)
            && let Some(value) = self.value(name).cloned()
        {
            self.push(Diagnostic::error("bad-value", value.span, message));
        }
        (min, max)
    }

    /// Three numbers, each of its own attribute.
    pub(crate) fn numbers(&mut self, names: [&str; 3]) -> [f64; 3] {
        names.map(|name| self.number(name, 0.0))
    }

    /// Three lengths, each of its own attribute.
    pub(crate) fn lengths(&mut self, names: [&str; 3]) -> [f64; 3] {
        names.map(|name| self.length(name, 0.0))
    }

    /// One, two or three numbers, separated by commas.
    fn list(&mut self, name: &str) -> Option<Vec<f64>> {
        let value = self.value(name).cloned()?;
        let parts: Vec<Option<f64>> = value.text.split(',').map(finite).collect();
        let numbers: Option<Vec<f64>> = parts.into_iter().collect();
        if let Some(numbers) = numbers.filter(|numbers| numbers.len() <= 3) {
            return Some(numbers);
        }
        self.bad_number(
            name,
            &value,
            "one, two or three numbers separated by commas",
        );
        None
    }

    /// One, two or three lengths in millimetres.
    pub(crate) fn lengths_of_list(&mut self, name: &str) -> Option<Vec<f64>> {
        let mut lengths = self.list(name)?;
        for length in &mut lengths {
            *length = self.units.length(*length);
        }
        if lengths.iter().all(|length| length.is_finite()) {
            return Some(lengths);
        }
        let value = self.value(name).cloned()?;
        let message = format!(
            "expected finite lengths for `{name}`, found `{}`",
            value.text
        );
        self.push(Diagnostic::error("bad-number", value.span, message));
        None
    }

    /// A whole number, at least 0.
    pub(crate) fn count(&mut self, name: &str, default: u32) -> u32 {
        let Some(value) = self.value(name).cloned() else {
            return default;
        };
        if let Ok(number) = value.text.trim().parse() {
            return number;
        }
        self.bad_number(name, &value, "a whole number");
        default
    }

    /// A whole number.
    pub(crate) fn integer(&mut self, name: &str, default: i64) -> i64 {
        let Some(value) = self.value(name).cloned() else {
            return default;
        };
        if let Ok(number) = value.text.trim().parse() {
            return number;
        }
        self.bad_number(name, &value, "a whole number");
        default
    }

    /// A flag: a whole number, `true` or `false`.
    pub(crate) fn flag(&mut self, name: &str) -> bool {
        let Some(value) = self.value(name).cloned() else {
            return false;
        };
        match value.text.trim() {
            "true" => true,
            "false" => false,
            number => number.parse::<i64>().map_or_else(
                |_| {
                    self.bad_number(name, &value, "`0`, `1`, `true` or `false`");
                    false
                },
                |number| number > 0,
            ),
        }
    }

    /// One of some words. RoboComp reads the words of `render` in any case.
    pub(crate) fn word<T: Copy>(&mut self, name: &str, words: &[(&str, T)], default: T) -> T {
        let Some(value) = self.value(name).cloned() else {
            return default;
        };
        let same = |word: &str| word.eq_ignore_ascii_case(value.text.trim());
        if let Some((_, meant)) = words.iter().find(|(word, _)| same(word)) {
            return *meant;
        }
        let message = format!("unknown value `{}` of `{name}`", value.text);
        let diagnostic = Diagnostic::error("bad-value", value.span, message);
        self.push(diagnostic.suggest(&value.text, words.iter().map(|(word, _)| *word)));
        default
    }

    /// The axis of a joint.
    pub(crate) fn axis(&mut self) -> Axis {
        self.word(
            "axis",
            &[("x", Axis::X), ("y", Axis::Y), ("z", Axis::Z)],
            Axis::Z,
        )
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|n: &f64| n.is_finite())
}

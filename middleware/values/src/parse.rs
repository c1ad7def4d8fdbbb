//! The text of a type in a description.

use rc_vocabulary::Primitive;
use std::sync::Arc;

/// A type whose names are not resolved.
pub(crate) type Parsed = rc_vocabulary::Type<String>;

/// The most levels of types in one text.
const LEVELS: u32 = 32;

/// Reads a type; the error says what was expected.
pub(crate) fn parse(text: &str) -> Result<Parsed, String> {
    let mut parser = Parser { rest: text };
    let found = parser.ty(0)?;
    if parser.rest.is_empty() {
        Ok(found)
    } else {
        Err(format!(
            "expected the end of the type, found `{}`",
            parser.rest
        ))
    }
}

struct Parser<'t> {
    rest: &'t str,
}

impl Parser<'_> {
    fn ty(&mut self, level: u32) -> Result<Parsed, String> {
        if level > LEVELS {
            return Err(format!("a type has at most {LEVELS} levels"));
        }
        let word = self.word()?;
        let mut found = match word.as_str() {
            "string" => Parsed::Text {
                bound: if self.eat("<") {
                    let bound = self.number()?;
                    self.expect(">")?;
                    Some(bound)
                } else {
                    None
                },
            },
            "sequence" => {
                self.expect("<")?;
                let element = self.ty(level + 1)?;
                let bound = self.eat(",").then(|| self.number()).transpose()?;
                self.expect(">")?;
                Parsed::Sequence {
                    element: Arc::new(element),
                    bound,
                }
            }
            "dictionary" => {
                self.expect("<")?;
                let key = self.ty(level + 1)?;
                self.expect(",")?;
                let value = self.ty(level + 1)?;
                self.expect(">")?;
                Parsed::Dictionary {
                    key: Arc::new(key),
                    value: Arc::new(value),
                }
            }
            name => match Primitive::from_word(name) {
                Some(primitive) => Parsed::Primitive(primitive),
                None => Parsed::Named(word),
            },
        };
        let mut levels = level;
        while self.eat("[") {
            levels += 1;
            if levels > LEVELS {
                return Err(format!("a type has at most {LEVELS} levels"));
            }
            let length = self.number()?;
            self.expect("]")?;
            found = Parsed::Array {
                element: Arc::new(found),
                length,
            };
        }
        Ok(found)
    }

    fn word(&mut self) -> Result<String, String> {
        let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == ':';
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        if word.is_empty() {
            return Err(format!("expected a type, found `{}`", self.rest));
        }
        self.rest = rest;
        Ok(word.to_owned())
    }

    /// A number from 1 on.
    fn number(&mut self) -> Result<u32, String> {
        let is_digit = |c: char| c.is_ascii_digit();
        let end = self.rest.find(|c| !is_digit(c)).unwrap_or(self.rest.len());
        let (digits, rest) = self.rest.split_at(end);
        let number = digits.parse().ok().filter(|number| *number > 0);
        self.rest = rest;
        number.ok_or_else(|| format!("expected a number from 1 to 4294967295, found `{digits}`"))
    }

    fn eat(&mut self, wanted: &str) -> bool {
        match self.rest.strip_prefix(wanted) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn expect(&mut self, wanted: &str) -> Result<(), String> {
        if self.eat(wanted) {
            Ok(())
        } else {
            Err(format!("expected `{wanted}`, found `{}`", self.rest))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_read_as_they_are_written() {
        let float = || Arc::new(Parsed::Primitive(Primitive::F32));
        assert_eq!(
            parse("float32[3]"),
            Ok(Parsed::Array {
                element: float(),
                length: 3
            })
        );
        assert_eq!(
            parse("sequence<float32,16>"),
            Ok(Parsed::Sequence {
                element: float(),
                bound: Some(16)
            })
        );
        assert_eq!(
            parse("dictionary<string<8>,A::B>"),
            Ok(Parsed::Dictionary {
                key: Arc::new(Parsed::Text { bound: Some(8) }),
                value: Arc::new(Parsed::Named("A::B".to_owned()))
            })
        );
        for wrong in [
            "",
            "float32[0]",
            "float32[",
            "sequence<",
            "sequence<A,>",
            "string<0>",
            "A B",
            "int8]",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
        let deep = format!("{}int8{}", "sequence<".repeat(1000), ">".repeat(1000));
        assert!(parse(&deep).is_err());
        assert!(parse(&format!("int8{}", "[1]".repeat(1000))).is_err());
    }
}

//! The texts of plans.
//!
//! ```text
//! plan    = part ("," part)*
//! part    = OPERATION ("i" | "I" | "o" | "O" | "e" EXCEPTION) ":" item*
//! item    = COUNT? LETTER ("{" CONVERSION "}")?      letters of Python's struct; x is a byte
//!         | "s" | "[" item* "]" | COUNT "(" item* ")"
//!         | BOUND "<" PADDING "," STRIDE ":" item* ">"
//!         | COUNT? LETTER "!"                          a number of the group around it
//!         | "{" item* "|" formula "}"
//! formula = (LETTER operands ";")* "=" operands      letters of operations
//! operands = operand ("&" operand)*
//! operand = "@" NUMBER | "$" STEP | CONSTANT         a constant as `1e3`
//! ```

use crate::formula::{Formula, Operand, Operation, Step};
use crate::item::Item;
use crate::plan::{Part, Place, Plan};
use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;
use rc_quantity::Conversion;
use rc_vocabulary::Primitive;

/// The most bytes of the text of a plan. A command line takes twice as many in one argument.
pub const LONGEST: usize = 64 << 10;
/// The most levels of sequences and arrays.
pub const DEEPEST: usize = 32;

/// Why a text is no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanError {
    /// The byte of the text that is wrong.
    pub at: usize,
    /// What belongs there.
    pub expected: &'static str,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {} at byte {}", self.expected, self.at)
    }
}

impl core::error::Error for PlanError {}

impl FromStr for Plan {
    type Err = PlanError;

    fn from_str(text: &str) -> Result<Self, PlanError> {
        let mut parser = Parser {
            text,
            at: 0,
            groups: 0,
        };
        if text.len() > LONGEST {
            return parser.fail("at most 65536 bytes");
        }
        let mut parts = Vec::new();
        loop {
            parts.push(parser.part()?);
            if parser.at == text.len() {
                return Ok(Self { parts });
            }
            parser.expect(',', "`,` or the end")?;
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    /// The groups that are open.
    groups: usize,
}

impl Parser<'_> {
    fn fail<T>(&self, expected: &'static str) -> Result<T, PlanError> {
        Err(PlanError {
            at: self.at,
            expected,
        })
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        if found {
            self.at += wanted.len_utf8();
        }
        found
    }

    fn expect(&mut self, wanted: char, expected: &'static str) -> Result<(), PlanError> {
        if self.take(wanted) {
            Ok(())
        } else {
            self.fail(expected)
        }
    }

    /// A number, if there is one.
    fn count(&mut self) -> Result<Option<u32>, PlanError> {
        let rest = &self.text[self.at..];
        let length = rest.bytes().take_while(u8::is_ascii_digit).count();
        if length == 0 {
            return Ok(None);
        }
        let Ok(count) = rest[..length].parse() else {
            return self.fail("a number below 2^32");
        };
        self.at += length;
        Ok(Some(count))
    }

    fn number(&mut self) -> Result<u32, PlanError> {
        match self.count()? {
            Some(count) => Ok(count),
            None => self.fail("a number"),
        }
    }

    fn part(&mut self) -> Result<Part, PlanError> {
        let operation = self.number()?;
        let place = if self.take('i') {
            Place::Input
        } else if self.take('I') {
            Place::InputImage
        } else if self.take('o') {
            Place::Output
        } else if self.take('O') {
            Place::OutputImage
        } else if self.take('e') {
            Place::Exception(self.number()?)
        } else {
            return self.fail("`i`, `I`, `o`, `O` or `e`");
        };
        self.expect(':', "`:`")?;
        Ok(Part {
            operation,
            place,
            items: self.items(0)?,
        })
    }

    /// Values up to a character that begins none.
    fn items(&mut self, depth: usize) -> Result<Vec<Item>, PlanError> {
        if depth > DEEPEST {
            return self.fail("at most 32 levels");
        }
        let mut items = Vec::new();
        while let Some(next) = self
            .peek()
            .filter(|c| !matches!(c, ',' | ']' | ')' | '>' | '|'))
        {
            let count = self.count()?;
            if count == Some(0) {
                return self.fail("a number above 0");
            }
            let times = count.unwrap_or(1);
            items.push(if count.is_none() && self.take('s') {
                Item::Text
            } else if count.is_none() && self.take('[') {
                let items = self.items(depth + 1)?;
                self.expect(']', "a value or `]`")?;
                Item::Sequence(items)
            } else if count.is_none() && self.take('{') {
                self.group(depth)?
            } else if count.is_some() && self.take('(') {
                let items = self.items(depth + 1)?;
                self.expect(')', "a value or `)`")?;
                Item::Array(times, items)
            } else if count.is_some() && self.take('<') {
                let padding = self.number()?;
                self.expect(',', "`,`")?;
                let stride = self.number()?;
                if stride == 0 {
                    // All elements would be one.
                    return self.fail("a stride above 0");
                }
                self.expect(':', "`:`")?;
                let items = self.items(depth + 1)?;
                self.expect('>', "a value or `>`")?;
                Item::Bounded {
                    bound: times,
                    padding,
                    stride,
                    items,
                }
            } else if self.take('x') {
                Item::Bytes(times)
            } else {
                self.numbers(times, next)?
            });
        }
        Ok(items)
    }

    fn numbers(&mut self, times: u32, next: char) -> Result<Item, PlanError> {
        let letter = self.peek().unwrap_or(next);
        let number = Primitive::from_letter(letter).filter(|number| *number != Primitive::Bool);
        let Some(number) = number else {
            return self.fail("a value");
        };
        self.take(letter);
        if self.groups > 0 && self.take('!') {
            return Ok(Item::Marked(times, number));
        }
        if !self.take('{') {
            return Ok(Item::Numbers(times, number, None));
        }
        let rest = &self.text[self.at..];
        let code = rest.find('}').and_then(|end| rest.get(..end));
        let Some((code, conversion)) =
            code.and_then(|code| Some((code, Conversion::from_code(code)?)))
        else {
            return self.fail("a conversion such as `1/1000}`");
        };
        self.at += code.len() + 1;
        Ok(Item::Numbers(times, number, Some(conversion)))
    }

    /// What follows the `{` of a group.
    fn group(&mut self, depth: usize) -> Result<Item, PlanError> {
        self.groups += 1;
        let items = self.items(depth + 1)?;
        self.groups -= 1;
        self.expect('|', "a value or `|`")?;
        let at = self.at;
        let mut steps = Vec::new();
        while !self.take('=') {
            let operation = self.peek().and_then(Operation::from_letter);
            let Some((operation, count)) = operation else {
                return self.fail("an operation or `=`");
            };
            self.at += 1;
            let operands = self.operands()?;
            if operands.len() != count {
                return self.fail("the operands of the operation");
            }
            self.expect(';', "`;`")?;
            steps.push(Step {
                operation,
                operands,
            });
        }
        let outputs = self.operands()?;
        let formula = Formula { steps, outputs };
        let inputs = items
            .iter()
            .map(Item::marked)
            .fold(0, usize::saturating_add);
        if !formula.is_closed(inputs) {
            self.at = at;
            return self.fail("a formula of the numbers of the group");
        }
        self.expect('}', "`}`")?;
        Ok(Item::Group { items, formula })
    }

    fn operands(&mut self) -> Result<Vec<Operand>, PlanError> {
        let mut operands = Vec::new();
        loop {
            operands.push(if self.take('@') {
                Operand::Input(self.number()?)
            } else if self.take('$') {
                Operand::Step(self.number()?)
            } else {
                let rest = &self.text[self.at..];
                let end = rest.find(['&', ';', '}']).unwrap_or(rest.len());
                let Ok(constant) = rest[..end].parse::<f64>() else {
                    return self.fail("a number");
                };
                self.at += end;
                Operand::Constant(constant.to_bits())
            });
            if !self.take('&') {
                return Ok(operands);
            }
        }
    }
}

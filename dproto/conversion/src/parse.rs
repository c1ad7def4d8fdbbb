//! The texts of plans.
//!
//! ```text
//! plan    = part ("," part)*
//! part    = OPERATION ("i" | "I" | "o" | "O" | "e" EXCEPTION) move* ":" item*
//! move    = "^" (FRAME | "$" TEXT) ">" FRAME "@" time ("+" time)*
//! time    = KEPT "*" NANOSECONDS
//! item    = COUNT? LETTER ("{" CONVERSION "}")?      letters of Python's struct; x is a byte
//!         | "s" | "[" item* "]" | COUNT "(" item* ")"
//!         | BOUND "<" PADDING "," STRIDE ":" item* ">"
//!         | "s?" | LETTER "?"                          a value that a move needs
//!         | COUNT? LETTER "!"                          a number of the group around it
//!         | "{" item* "|" formula "}"
//! formula = (LETTER operands ";")* "=" operands      letters of operations
//! operands = operand ("&" operand)*
//! operand = "@" NUMBER | "$" STEP | "^" NUMBER       the last one in the transforms of the moves
//!         | CONSTANT                                 a constant as `1e3`
//! ```

use crate::formula::{Formula, Operand, Operation, Step};
use crate::item::Item;
use crate::moves::{Frame, Move, is_frame};
use crate::plan::{Part, Place, Plan};
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;
use rc_quantity::Conversion;
use rc_vocabulary::Primitive;

/// The most bytes of the text of a plan. A command line takes twice as many in one argument.
pub const LONGEST: usize = 64 << 10;
/// The most levels of sequences and arrays.
pub const DEEPEST: usize = 32;

/// Why a text is not a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanError {
    /// The byte of the text that is wrong.
    pub at: usize,
    /// What the parser expected.
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
            loops: 0,
            transforms: 0,
            kept: (0, 0),
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
    /// The sequences and arrays that are open.
    loops: usize,
    /// The numbers of the transforms of the part.
    transforms: usize,
    /// The kept texts and numbers of the part.
    kept: (u32, u32),
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
        let at = self.at;
        let mut moves = Vec::new();
        while self.take('^') {
            moves.push(self.change()?);
        }
        self.transforms = 12 * moves.len();
        self.kept = (0, 0);
        self.expect(':', "`^` or `:`")?;
        let items = self.items(0)?;
        let (texts, numbers) = self.kept;
        let is_kept = |one: &Move| {
            let name = match &one.from {
                Frame::Kept(at) => *at < texts,
                Frame::Named(_) => true,
            };
            name && one.stamp.iter().all(|(at, _)| *at < numbers)
        };
        if !moves.iter().all(is_kept) {
            self.at = at;
            return self.fail("a change of frames whose values are kept");
        }
        Ok(Part {
            operation,
            place,
            moves,
            items,
        })
    }

    /// What follows the `^` of a change of frames.
    fn change(&mut self) -> Result<Move, PlanError> {
        let from = if self.take('$') {
            Frame::Kept(self.number()?)
        } else {
            Frame::Named(self.frame('>')?)
        };
        self.expect('>', "`>`")?;
        let to = self.frame('@')?;
        self.expect('@', "`@`")?;
        let mut stamp = Vec::new();
        loop {
            let at = self.number()?;
            self.expect('*', "`*`")?;
            stamp.push((at, self.number()?));
            if !self.take('+') {
                return Ok(Move { from, to, stamp });
            }
        }
    }

    /// The name of a frame, up to a character.
    fn frame(&mut self, end: char) -> Result<String, PlanError> {
        let rest = &self.text[self.at..];
        let name = rest.find(end).and_then(|end| rest.get(..end));
        let Some(name) = name.filter(|name| is_frame(name)) else {
            return self.fail("the name of a frame");
        };
        self.at += name.len();
        Ok(name.into())
    }

    /// Values that repeat: nothing in them is kept.
    fn repeated(&mut self, depth: usize) -> Result<Vec<Item>, PlanError> {
        self.loops += 1;
        let items = self.items(depth)?;
        self.loops -= 1;
        Ok(items)
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
                if self.loops == 0 && self.take('?') {
                    self.kept.0 += 1;
                    Item::KeptText
                } else {
                    Item::Text
                }
            } else if count.is_none() && self.take('[') {
                let items = self.repeated(depth + 1)?;
                self.expect(']', "a value or `]`")?;
                Item::Sequence(items)
            } else if count.is_none() && self.take('{') {
                self.group(depth)?
            } else if count.is_some() && self.take('(') {
                let items = self.repeated(depth + 1)?;
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
                let items = self.repeated(depth + 1)?;
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
        if times == 1 && self.loops == 0 && self.take('?') {
            self.kept.1 += 1;
            return Ok(Item::KeptNumber(number, self.conversion()?));
        }
        if self.groups > 0 && self.take('!') {
            return Ok(Item::Marked(times, number));
        }
        Ok(Item::Numbers(times, number, self.conversion()?))
    }

    /// The conversion behind a number, if it has one.
    fn conversion(&mut self) -> Result<Option<Conversion>, PlanError> {
        let Some(rest) = self.text[self.at..].strip_prefix('{') else {
            return Ok(None);
        };
        let code = rest.find('}').and_then(|end| rest.get(..end));
        // A group has values, which may have conversions, and its formula behind `|`.
        if code.is_some_and(|code| code.contains(['{', '|'])) {
            return Ok(None);
        }
        self.take('{');
        let Some((code, conversion)) =
            code.and_then(|code| Some((code, Conversion::from_code(code)?)))
        else {
            return self.fail("a conversion such as `1/1000}`");
        };
        self.at += code.len() + 1;
        Ok(Some(conversion))
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
        let locks = if self.take('%') {
            self.operands()?
        } else {
            Vec::new()
        };
        let formula = Formula {
            steps,
            outputs,
            locks,
        };
        let inputs = items
            .iter()
            .map(Item::marked)
            .fold(0, usize::saturating_add);
        if !formula.is_closed(inputs, self.transforms) {
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
            } else if self.take('^') {
                Operand::Transform(self.number()?)
            } else {
                let rest = &self.text[self.at..];
                let end = rest.find(['&', ';', '%', '}']).unwrap_or(rest.len());
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

//! Attributes that hold the numbers of a data prototype.

use rc_formula::Program;
use rc_vocabulary::Primitive;

/// Beyond this, a conversion may give infinite numbers.
const LARGE: f64 = 1e9;

/// The numbers of a data prototype: one value, or those of a sequence one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Name of the prototype.
    pub prototype: String,
    /// The meaning of the numbers, in one line.
    pub meaning: String,
    /// The numbers of one value, in their order.
    pub numbers: Vec<Number>,
    /// Whether there may be any number of values.
    pub is_sequence: bool,
    /// Refuses numbers that mean nothing.
    pub check: Program,
    /// The formula from the numbers to x, y and z in metres and the angles about x, y and z of `R =
    /// Rx·Ry·Rz`, if they are a pose.
    pub pose: Option<Program>,
    /// The attribute whose value this one is in another representation.
    pub consistent_with: Option<String>,
    /// The formulas from the numbers to those of the other attributes that have this value.
    pub conversions: Vec<Conversion>,
}

/// A number of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Its name: `Position.x`.
    pub name: String,
    /// Its unit.
    pub unit: Option<String>,
    /// How the type of the prototype stores it.
    pub number: Primitive,
}

/// The formula from the numbers of one attribute to those of another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Conversion {
    /// The other attribute.
    pub to: String,
    /// The formula.
    pub program: Program,
}

impl Block {
    /// The type as a schema names it.
    pub fn text(&self) -> String {
        format!("dproto {}", self.prototype)
    }

    /// How many numbers a value has.
    pub fn count_text(&self) -> String {
        let each = if self.is_sequence {
            " for each value"
        } else {
            ""
        };
        format!("{} numbers{each}", self.numbers.len())
    }

    /// The unit of all numbers, if they have one.
    pub fn common_unit(&self) -> Option<&str> {
        let mut units = self.numbers.iter().map(|number| number.unit.as_deref());
        let first = units.next().flatten()?;
        units.all(|unit| unit == Some(first)).then_some(first)
    }

    /// Why numbers are not a value of the prototype, or not of another attribute that has this
    /// value.
    pub fn refusal(&self, all: &[f64]) -> Option<String> {
        let count = self.numbers.len();
        let fits = if self.is_sequence {
            count > 0 && all.len().is_multiple_of(count)
        } else {
            all.len() == count
        };
        if !fits {
            return Some(format!("{} numbers, not {}", all.len(), self.count_text()));
        }
        let is_large = all.iter().any(|number| number.abs() > LARGE);
        for one in all.chunks_exact(count.max(1)) {
            for (number, value) in self.numbers.iter().zip(one) {
                let Some((least, most)) = number.number.limits() else {
                    continue;
                };
                if value.fract() != 0.0 || !(least as f64..=most as f64).contains(value) {
                    let word = number.number.word();
                    return Some(format!("`{}` as {value}, which is no {word}", number.name));
                }
            }
            if let Err(rejected) = self.check.run(one) {
                return Some(rejected.to_string());
            }
            if let Some(pose) = &self.pose
                && (is_large || !pose.is_total())
                && let Err(why) = six(pose, one)
            {
                return Some(format!("no pose: {why}"));
            }
            for other in &self.conversions {
                // Any other conversion gives numbers, when somebody asks for them.
                if (is_large || !other.program.is_total())
                    && let Err(why) = finite(&other.program, one)
                {
                    return Some(format!("no value of `{}`: {why}", other.to));
                }
            }
        }
        None
    }

    /// The pose: x, y and z in metres, then the angles about x, y and z. `None` if the numbers are
    /// not one.
    pub fn as_pose(&self, all: &[f64]) -> Option<[f64; 6]> {
        six(self.pose.as_ref()?, all).ok()
    }

    /// The numbers of another attribute that has this value. `None` if it does not convert.
    pub fn converted(&self, all: &[f64], to: &str) -> Option<Vec<f64>> {
        let way = self.conversions.iter().find(|way| way.to == to)?;
        let mut out = Vec::with_capacity(all.len());
        for one in all.chunks_exact(self.numbers.len().max(1)) {
            out.extend(finite(&way.program, one).ok()?);
        }
        Some(out)
    }
}

/// The result of the formula of a pose, which takes no covariance.
fn six(program: &Program, input: &[f64]) -> Result<[f64; 6], String> {
    let own = input.get(..program.inputs()).unwrap_or(input);
    let out = finite(program, own)?;
    out.try_into()
        .map_err(|out: Vec<f64>| format!("{} numbers", out.len()))
}

/// The result of a formula, if all of it is finite; otherwise the error.
fn finite(program: &Program, input: &[f64]) -> Result<Vec<f64>, String> {
    let out = program
        .run(input)
        .map_err(|rejected| rejected.to_string())?;
    match out.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(format!("it would be {value}")),
        None => Ok(out),
    }
}

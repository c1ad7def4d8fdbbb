//! A member that a connection converts.

use rc_idsl::model::Primitive;
use rc_quantity::Conversion as Factor;
use rc_vocabulary::Class;
use std::fmt;

/// A member that is converted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Converted {
    /// Numbers in another unit.
    Unit {
        /// `push.x` for a parameter, `Module::Struct.x` for a member.
        path: String,
        /// The unit of the sender, as written.
        from: String,
        /// The unit of the receiver, as written.
        to: String,
        /// The conversion.
        factor: Factor,
        /// The type of its numbers.
        number: Primitive,
    },
    /// Values of a structure with equal meaning in another representation.
    Meaning {
        /// `Module::Struct`
        path: String,
        /// The changes and their cost.
        what: String,
    },
}

impl fmt::Display for Converted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unit {
                path,
                from,
                to,
                factor,
                number,
            } => write!(
                f,
                "{path} {from} {factor} = {to}, {}",
                effort(factor, *number)
            ),
            Self::Meaning { path, what } => write!(f, "{path} {what}"),
        }
    }
}

/// The cost and loss of a number: `1 operation a number`.
pub(crate) fn effort(factor: &Factor, number: Primitive) -> String {
    let count = factor.factor().operations();
    let rounded = match number.class() {
        Class::Float | Class::Bool => "",
        Class::Signed | Class::Unsigned => ", rounded to whole numbers",
    };
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} operation{plural} a number{rounded}")
}

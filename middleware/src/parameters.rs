//! The parameters of a component, for a backend whose middleware has parameters of its own.

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// No value.
    None,
    /// `true` or `false`
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A number with a fraction.
    Float(f64),
    /// A text, a path, or a duration with its unit.
    Text(String),
    /// An array of booleans.
    Bools(Vec<bool>),
    /// An array of integers.
    Ints(Vec<i64>),
    /// An array of numbers with a fraction.
    Floats(Vec<f64>),
    /// An array of texts.
    Texts(Vec<String>),
}

/// One parameter. Secret parameters are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Path, as in `motors[2].max`.
    pub path: String,
    /// Current value.
    pub value: ParameterValue,
    /// Documentation from the `.pdsl`.
    pub doc: String,
    /// Type and its limits, in words.
    pub allowed: String,
    /// Whether a running component accepts changes of it.
    pub editable: bool,
    /// The smallest and the largest value of a number.
    pub range: Option<(ParameterValue, ParameterValue)>,
}

/// A change of parameters. Secret parameters are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterEvent {
    /// Parameters that exist from now on: all of them, when the component starts.
    pub new: Vec<Parameter>,
    /// Parameters that have another value now.
    pub changed: Vec<Parameter>,
}

/// Called with each change of parameters. It must return at once: it runs on a thread that has
/// other tasks.
pub type ParameterListener = Box<dyn Fn(ParameterEvent) + Send>;

/// The parameters of one component. Any thread but that of the worker may call it; it returns
/// within a few seconds.
pub trait ParameterService: Send + Sync {
    /// All parameters, in the order of the `.pdsl`. It fails when the component ends or does not
    /// respond.
    fn list(&self) -> Result<Vec<Parameter>, String>;

    /// Changes all of these parameters or none. The error says why nothing has changed.
    fn set(&self, changes: &[(String, ParameterValue)]) -> Result<(), String>;

    /// Calls `listener` with all parameters, and from then on with every accepted change, from
    /// any source. Changes of one request are one call.
    fn watch(&self, listener: ParameterListener);
}

//! The parameters of a component, for a backend whose middleware has a way of its own to them.

/// What a parameter is.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// Nothing.
    None,
    /// `true` or `false`
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// Any other number.
    Float(f64),
    /// A text, a path, or a time with its unit.
    Text(String),
    /// An array of choices.
    Bools(Vec<bool>),
    /// An array of whole numbers.
    Ints(Vec<i64>),
    /// An array of other numbers.
    Floats(Vec<f64>),
    /// An array of texts.
    Texts(Vec<String>),
}

/// One parameter. What is secret is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its path, `motors[2].max`.
    pub path: String,
    /// What it is.
    pub value: ParameterValue,
    /// Its documentation.
    pub doc: String,
    /// Its type and limits in words.
    pub allowed: String,
    /// Whether it may be changed.
    pub editable: bool,
    /// Its smallest and its largest value, of a number.
    pub range: Option<(ParameterValue, ParameterValue)>,
}

/// What has become of parameters at one time. What is secret is told of never.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterEvent {
    /// What there is from now on: all, when the component begins.
    pub new: Vec<Parameter>,
    /// What has another value now.
    pub changed: Vec<Parameter>,
}

/// Hears of parameters. It is called on a thread that has other things to do, and returns at once.
pub type ParameterListener = Box<dyn Fn(ParameterEvent) + Send>;

/// The parameters of one component. It is asked from any thread but that of the worker, and answers within a few seconds.
pub trait ParameterService: Send + Sync {
    /// All of them, in the order of the `.pdsl`; an error is a component that ends or does not answer.
    fn list(&self) -> Result<Vec<Parameter>, String>;

    /// Changes all of these, or none; an error says why nothing has changed.
    fn set(&self, changes: &[(String, ParameterValue)]) -> Result<(), String>;

    /// Tells `listener` of all parameters, and from then on of every change that was accepted, whoever asked for it; changes that
    /// were asked for together are told together.
    fn watch(&self, listener: ParameterListener);
}

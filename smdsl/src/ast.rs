//! The syntax tree of an `.smdsl` file. Names are not resolved.

use rc_syntax::Name;

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The machine. `None` after a syntax error.
    pub machine: Option<Block>,
    /// The blocks of substates.
    pub substates: Vec<Block>,
    /// Whether no input was skipped that could declare a state.
    pub complete: bool,
}

/// `NAME { … };` or `:PARENT parallel { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The name of the machine, or of the parent of these states.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The keyword `parallel`, if present.
    pub parallel: Option<Name>,
    /// Clauses, in the order of the file.
    pub clauses: Vec<Clause>,
    /// Whether no clause was skipped.
    pub complete: bool,
}

/// One clause of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Clause {
    /// Keyword of the clause.
    pub keyword: Name,
    /// Parsed content.
    pub kind: ClauseKind,
}

/// The kinds of clauses.
#[derive(Clone, Debug, PartialEq)]
pub enum ClauseKind {
    /// `states a, b;`
    States(Vec<State>),
    /// `initial_state a;` The resolver reports more than one state.
    Initial(Vec<State>),
    /// `end_state a;` The resolver reports more than one state.
    End(Vec<State>),
    /// `transitions { … }`
    Transitions(Vec<Transition>),
}

/// The declaration of a state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The name as declared.
    pub name: Name,
    /// The lines of its own documentation, or of the clause's documentation.
    pub doc: Vec<String>,
}

/// `a => b, c;`
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// The source state.
    pub source: Name,
    /// The target states, one transition each.
    pub targets: Vec<Name>,
    /// The lines of its documentation.
    pub doc: Vec<String>,
}

//! What stands in one `.smdsl` file, in its order, nothing resolved yet.

use rc_syntax::Name;

/// A whole file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The machine, if one could be read.
    pub machine: Option<Block>,
    /// The blocks of substates after it.
    pub substates: Vec<Block>,
    /// Whether nothing that could declare a state was left unread.
    pub complete: bool,
}

/// `NAME { … };` or `:PARENT parallel { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The machine's name, or the state that holds these states.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The word `parallel`, where it stands.
    pub parallel: Option<Name>,
    /// Its clauses.
    pub clauses: Vec<Clause>,
    /// Whether every clause could be read.
    pub complete: bool,
}

/// One clause of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Clause {
    /// The word that begins it.
    pub keyword: Name,
    /// What it says.
    pub kind: ClauseKind,
}

/// The clauses.
#[derive(Clone, Debug, PartialEq)]
pub enum ClauseKind {
    /// `states a, b;`
    States(Vec<State>),
    /// `initial_state a;` More than one is a mistake that is told later.
    Initial(Vec<State>),
    /// `end_state a;` More than one is a mistake that is told later.
    End(Vec<State>),
    /// `transitions { … }`
    Transitions(Vec<Transition>),
}

/// A state where it is declared.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Its name.
    pub name: Name,
    /// Its documentation: its own, or that of the whole clause.
    pub doc: Vec<String>,
}

/// `a => b, c;`
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// Where it begins.
    pub source: Name,
    /// Where it may lead.
    pub targets: Vec<Name>,
    /// Its documentation.
    pub doc: Vec<String>,
}

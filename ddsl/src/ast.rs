//! What stands in one `.ddsl` file, in its order, nothing resolved yet.

use rc_syntax::{Literal, Name};

/// A whole file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The imported paths as written.
    pub imports: Vec<Name>,
    /// The deployment, if one could be read.
    pub deployment: Option<Deployment>,
}

/// `Deployment NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Deployment {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What stands in it.
    pub decls: Vec<Decl>,
}

/// What stands in a deployment or in a group.
#[derive(Clone, Debug, PartialEq)]
pub enum Decl {
    /// `Host NAME { … };`
    Host(Host),
    /// `Component NAME { … };`
    Component(Component),
    /// `Group NAME { … };`
    Group(Group),
    /// `bind a.Laser -> b.Laser;`
    Bind(Bind),
    /// `middleware dds { lease 500ms; };`
    Middleware(Middleware),
    /// `domain 7;`, with its word
    Domain(Name, Literal),
}

/// `middleware NAME;` or `middleware NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Middleware {
    /// Which.
    pub name: Name,
    /// What is set of it, each key with its values; none where there is no block.
    pub settings: Option<Vec<(Name, Vec<Literal>)>>,
}

/// `Host NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Host {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The word that begins each field, and its text.
    pub fields: Vec<(Name, Name)>,
    /// Something in it could not be read, and was reported.
    pub incomplete: bool,
}

/// `Component NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its fields, each with the word that begins it.
    pub fields: Vec<(Name, Field)>,
    /// Something in it could not be read, and was reported.
    pub incomplete: bool,
}

/// One field of a component.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// `cdsl "../lidar/lidar.cdsl";`
    Cdsl(Name),
    /// `executable "bin/lidar";`
    Executable(Name),
    /// `config "lidar.toml";`
    Config(Name),
    /// `endpoint "10.0.0.2:7000";`
    Endpoint(Name),
    /// `host robot;`
    Host(Name),
    /// `after simulator, arm;`
    After(Vec<Name>),
    /// `restart on_failure max 3 within 1min backoff 500ms;`
    Restart(Restart),
    /// `ready 5s;`
    Ready(Literal),
    /// `stop 1s;`
    Stop(Literal),
    /// `env { RUST_LOG "debug"; };`
    Env(Vec<(Name, Name)>),
    /// `args "--log", "debug";`
    Args(Vec<Name>),
    /// `cpu 2, 3;`
    Cpu(Vec<Literal>),
    /// `priority 10;`
    Priority(Literal),
    /// `middleware dds { lease 500ms; };`
    Middleware(Middleware),
    /// `domain 7;`
    Domain(Literal),
}

/// What follows the word `restart`.
#[derive(Clone, Debug, PartialEq)]
pub struct Restart {
    /// `never`, `on_failure` or `always`, or a word that is none of them.
    pub policy: Name,
    /// `max N within T`
    pub limit: Option<(Literal, Literal)>,
    /// `backoff T`
    pub backoff: Option<Literal>,
}

/// `Group NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What stands in it.
    pub decls: Vec<Decl>,
    /// The word `export` of each of its clauses, and what that lets out.
    pub exports: Vec<(Name, Vec<Name>)>,
    /// Something in it could not be read, and was reported.
    pub incomplete: bool,
}

/// `bind avoider.Laser -> sensors.Laser;`
#[derive(Clone, Debug, PartialEq)]
pub struct Bind {
    /// The slot that requires or subscribes.
    pub consumer: SlotPath,
    /// The slot that implements or publishes.
    pub provider: SlotPath,
}

/// A slot with the way to it.
#[derive(Clone, Debug, PartialEq)]
pub struct SlotPath {
    /// Groups from outside to inside, and a component or a group; at least one name.
    pub path: Vec<Name>,
    /// The slot.
    pub slot: Name,
}

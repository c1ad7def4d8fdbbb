//! The pages for users, README.md and `docs`: their links, their code, and the commands on them.

mod book;
mod code;
mod layers;
mod links;
mod markdown;
mod reference;
mod session;

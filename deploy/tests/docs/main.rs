//! The pages for users, README.md and `docs`: their links, their code, and the commands on them.

mod book;
mod code;
mod features;
mod layers;
mod links;
mod markdown;
mod reference;
mod session;

//! The supervisor: it starts, watches and stops the components of a network.

mod chains;
mod check;
pub mod commands;
pub(crate) mod control;
pub mod detach;
mod ends;
mod flight_recorder;
mod followers;
mod health;
mod hosts;
mod lifecycle_control;
mod memory_growth;
mod memory_loss;
mod messages;
mod network_logs;
mod network_troubles;
pub mod options;
mod parameter_changes;
mod process_handle;
mod proposal_answers;
mod proposals;
mod proxies;
mod renewal;
mod requests;
pub(crate) mod restart;
mod start_order;
mod start_scheduler;
mod start_times;
mod starts;
mod supervise;
#[cfg(test)]
mod tests;
mod unit;
mod unit_lifecycle;
pub mod up;

//! The program as a user meets it, command by command, and the training package that calls it.

mod chart;
mod cli;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod dataset;
mod export;
#[path = "../common/program.rs"]
mod program;
mod scenes;
mod trace;
mod training;

//! The program as a user meets it, command by command, and the training package that calls it.

#[path = "../../../../tests/common/build.rs"]
mod build;
mod chart;
mod cli;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod compare;
mod counted;
mod dataset;
mod export;
#[path = "../../../../tests/common/figures.rs"]
mod figures;
mod fit;
#[path = "../../../../tests/common/glb.rs"]
mod glb;
mod poses;
#[path = "../../../../tests/common/program.rs"]
mod program;
mod published;
mod scenes;
mod stability;
mod trace;
mod training;
mod tuned;
mod weights;

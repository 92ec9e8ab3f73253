//! Published generators: from a PyTorch state dict to a weights file to a picture, against PyTorch
//! and through the program.

mod apply;
mod convert;
mod state;

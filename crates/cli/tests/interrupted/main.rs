//! Commands that are stopped by a signal or killed. They stay apart from the other tests of the binary, because they measure how
//! soon a command stops, and need a machine that is not busy with the commands of those.

mod signals;
mod sweep_interrupted;

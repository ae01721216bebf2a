//! Tests of commands that are stopped by a signal or killed. They are separate from other tests because
//! they measure how soon a command stops, which needs an idle machine.

mod signals;
mod sweep_interrupted;

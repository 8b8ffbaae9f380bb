//! The lens models against other implementations, against their own derivatives, and there and back.

mod tables;

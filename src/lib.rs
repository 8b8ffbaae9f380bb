//! rockmap: maps of rocks from posed pictures.
//!
//! A datum flows one way, and a module uses only those above it:
//!
//! | module | what it does |
//! |---|---|
//! | [`error`] | what can go wrong at the edges, and how it is said |
//! | [`frame`] | typed points, rays, transforms; ellipsoids and coordinate reference systems |
//! | [`input`] | tables and documents in which every value knows its place; records set aside |
//! | [`pose`] | pose logs: where the platform was at a time |
//! | [`camera`] | lens models and mounts: pixels to rays and back |
//! | [`detection`] | what a detector marked |
//! | [`view`] | a picture with its pose and camera |
//! | [`terrain`] | the ground: height at a place, first hit of a ray |
//! | [`project`] | a detection on the ground, with its uncertainty |
//! | [`matching`] | optimal assignment of two sides to each other |
//! | [`footprint`] | what a view could have seen |
//! | [`adjust`] | places of objects and errors of poses that agree best with the measurements |
//! | [`existence`] | which objects are real, and how often real ones are detected |
//! | [`fuse`] | detections of many views to one map of objects |
//! | [`publish`] | maps, tables, annotated pictures |
//! | [`evaluate`] | a map against truth |
//! | [`simulate`] | scenes with known truth: traverses, detectors, rendered pictures |
//! | [`bound`] | the best map that labelled detections allow |
//! | [`import`] | cameras and poses of others turned into files of our own |
//! | [`pipeline`] | a pipeline file to a map |
//! | [`compare`] | two maps of one place: what is the same, new, gone or moved |
//! | [`experiment`] | the paper's experiments, and a bench of methods over scenes |
//! | [`cli`] | the command line |

pub mod error;
pub mod frame;
pub mod input;

pub mod pose;

pub mod camera;
pub mod detection;
pub mod terrain;
pub mod view;

pub mod project;

pub mod matching;

pub mod footprint;

pub mod adjust;
pub mod existence;

pub mod fuse;

pub mod publish;

pub mod evaluate;

pub mod simulate;

pub mod bound;

pub mod import;

pub mod pipeline;

pub mod compare;

pub mod experiment;

pub mod cli;

//! Parquet files of one row group, plainly encoded.
//!
//! The format's own specification (`parquet.thrift`, version 2.10) is all this follows. A map's
//! layers are small, so there is one page a column, without compression or dictionaries.

use super::thrift::{Struct, varint};

/// A column of the file.
pub(super) struct Column {
    /// Its name, or that of its group and its own.
    path: Vec<&'static str>,
    kind: Type,
    cells: Vec<Option<Cell>>,
}

/// What a column's cells are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    /// UTF-8.
    Text,
    /// Bytes.
    Bytes,
    /// 64-bit integers.
    Integer,
    /// 64-bit floating-point numbers.
    Real,
    /// Nanoseconds since 1970, UTC.
    Time,
}

/// A cell that is not absent.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    /// Text or bytes.
    Bytes(Vec<u8>),
    /// An integer or an instant.
    Integer(i64),
    /// A number.
    Real(f64),
}

const MAGIC: &[u8; 4] = b"PAR1";
/// Numbers of the format's enums.
const PLAIN: i32 = 0;
const RLE: i32 = 3;
const UNCOMPRESSED: i32 = 0;
const DATA_PAGE: i32 = 0;
const REQUIRED: i32 = 0;
const OPTIONAL: i32 = 1;
const UTF8: i32 = 0;

impl Column {
    /// A column whose path has one name, or two where it is part of a group.
    pub(super) fn new(path: Vec<&'static str>, kind: Type, cells: Vec<Option<Cell>>) -> Self {
        Self { path, kind, cells }
    }

    fn name(&self) -> &'static str {
        self.path.last().copied().unwrap_or_default()
    }

    fn group(&self) -> Option<&'static str> {
        (self.path.len() > 1).then(|| self.path[0])
    }

    /// One data page: which cells are there, then those that are.
    fn page(&self) -> Vec<u8> {
        let mut levels = Vec::new();
        for run in self.cells.chunk_by(|a, b| a.is_some() == b.is_some()) {
            varint(&mut levels, (run.len() as u64) << 1);
            levels.push(u8::from(run[0].is_some()));
        }
        let mut data = length(&levels).to_vec();
        data.extend(levels);
        for cell in self.cells.iter().flatten() {
            match cell {
                Cell::Bytes(bytes) => {
                    data.extend(length(bytes));
                    data.extend(bytes);
                }
                Cell::Integer(n) => data.extend(n.to_le_bytes()),
                Cell::Real(x) => data.extend(x.to_le_bytes()),
            }
        }
        let levels_and_values = Struct::new()
            .i32(1, i32_of(self.cells.len()))
            .i32(2, PLAIN)
            .i32(3, RLE)
            .i32(4, RLE);
        let header = Struct::new()
            .i32(1, DATA_PAGE)
            .i32(2, i32_of(data.len()))
            .i32(3, i32_of(data.len()))
            .nested(5, levels_and_values);
        let mut page = header.finish();
        page.extend(data);
        page
    }

    /// What a reader can skip the column by.
    fn statistics(&self) -> Struct {
        let absent = self.cells.iter().filter(|c| c.is_none()).count();
        let statistics = Struct::new().i64(3, i64_of(absent));
        let numbers = self.cells.iter().flatten().filter_map(|cell| match cell {
            Cell::Real(x) => Some(*x),
            _ => None,
        });
        let (min, max) = (
            numbers.clone().min_by(f64::total_cmp),
            numbers.max_by(f64::total_cmp),
        );
        match (min, max) {
            (Some(min), Some(max)) => statistics
                .binary(5, &max.to_le_bytes())
                .binary(6, &min.to_le_bytes()),
            _ => statistics,
        }
    }

    fn physical_type(&self) -> i32 {
        match self.kind {
            Type::Integer | Type::Time => 2,
            Type::Real => 5,
            Type::Text | Type::Bytes => 6,
        }
    }

    fn schema_element(&self) -> Struct {
        let element = Struct::new()
            .i32(1, self.physical_type())
            .i32(3, OPTIONAL)
            .binary(4, self.name().as_bytes());
        match self.kind {
            Type::Text => {
                let string = Struct::new().nested(1, Struct::new());
                element.i32(6, UTF8).nested(10, string)
            }
            Type::Time => {
                let nanoseconds = Struct::new().nested(3, Struct::new());
                let stamp = Struct::new().yes(1).nested(2, nanoseconds);
                element.nested(10, Struct::new().nested(8, stamp))
            }
            Type::Bytes | Type::Integer | Type::Real => element,
        }
    }
}

/// The file: columns of `rows` cells each, and notes by key. Columns of a group stand together.
pub(super) fn bytes(columns: &[Column], rows: usize, notes: &[(&str, String)]) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    let mut chunks = Vec::new();
    let mut total = 0;
    for column in columns {
        let offset = i64_of(file.len());
        let page = column.page();
        let size = i64_of(page.len());
        total += size;
        file.extend(page);
        let about = Struct::new()
            .i32(1, column.physical_type())
            .i32s(2, &[PLAIN, RLE])
            .texts(3, &column.path)
            .i32(4, UNCOMPRESSED)
            .i64(5, i64_of(rows))
            .i64(6, size)
            .i64(7, size)
            .i64(9, offset)
            .nested(12, column.statistics());
        chunks.push(Struct::new().i64(2, 0).nested(3, about));
    }
    let row_group = Struct::new()
        .structs(1, chunks)
        .i64(2, total)
        .i64(3, i64_of(rows));
    let notes = notes.iter().map(|(key, value)| {
        Struct::new()
            .binary(1, key.as_bytes())
            .binary(2, value.as_bytes())
    });
    let type_defined = || Struct::new().nested(1, Struct::new());
    let footer = Struct::new()
        .i32(1, 2)
        .structs(2, schema(columns))
        .i64(3, i64_of(rows))
        .structs(4, vec![row_group])
        .structs(5, notes.collect())
        .binary(6, b"rockmap")
        .structs(7, columns.iter().map(|_| type_defined()).collect())
        .finish();
    file.extend(&footer);
    file.extend(length(&footer));
    file.extend(MAGIC);
    file
}

/// The schema as a list in depth-first order: the root, then columns and groups with their columns.
fn schema(columns: &[Column]) -> Vec<Struct> {
    let mut elements = Vec::new();
    let mut children = 0;
    let same_group = |a: &Column, b: &Column| a.group().is_some() && a.group() == b.group();
    for together in columns.chunk_by(same_group) {
        children += 1;
        if let Some(group) = together[0].group() {
            let element = Struct::new().i32(3, REQUIRED).binary(4, group.as_bytes());
            elements.push(element.i32(5, i32_of(together.len())));
        }
        elements.extend(together.iter().map(Column::schema_element));
    }
    let root = Struct::new().binary(4, b"schema").i32(5, children);
    elements.insert(0, root);
    elements
}

fn length(bytes: &[u8]) -> [u8; 4] {
    u32::try_from(bytes.len()).unwrap_or(u32::MAX).to_le_bytes()
}

/// Sizes of columns held in memory; a page of 2 GiB is out of a map's reach.
fn i32_of(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

fn i64_of(n: usize) -> i64 {
    i64::try_from(n).unwrap_or(i64::MAX)
}

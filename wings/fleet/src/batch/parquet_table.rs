//! Rows of a batch as a Parquet file.

use std::{path::Path, sync::Arc};

use parquet::{
    basic::Compression,
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type},
    file::{
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::parser::parse_message_type,
};

use super::{
    gather::{Gathered, gather},
    row::{LensRow, Row},
    store::Store,
};
use boresight_files::{FileStream, Overwrite, save_streamed};

/// Rows in memory before a write.
const GROUP: usize = 1 << 15;

/// A column: its name and its value in a row.
struct Column(&'static str, Value);

enum Value {
    Text(fn(&Row) -> Option<String>),
    Number(fn(&Row) -> Option<f64>),
    Whole(fn(&Row) -> Option<i64>),
    /// Milliseconds since 1970, UTC.
    Time(fn(&Row) -> Option<i64>),
}

use Value::{Number, Text, Time, Whole};

/// Every column, in order. Columns are only added.
const COLUMNS: &[Column] = &[
    Column("id", Text(|row| Some(row.id.clone()))),
    Column("session", Text(|row| Some(row.session.clone()))),
    Column("action", Text(|row| Some(format!("{:?}", row.action).to_lowercase()))),
    Column("code", Text(|row| Some(row.code.clone()))),
    Column("message", Text(|row| row.message.clone())),
    Column("created", Time(created_ms)),
    Column("source", Text(|row| row.source.clone())),
    Column("model", Text(|row| row.model.clone())),
    Column("usb", Text(|row| row.usb.clone())),
    Column("serial", Text(|row| row.serial.clone())),
    Column("width_px", Whole(|row| row.image_size.map(|size| size[0].into()))),
    Column("height_px", Whole(|row| row.image_size.map(|size| size[1].into()))),
    Column("verdict", Text(|row| row.verdict.clone())),
    Column("recorded_verdict", Text(|row| row.recorded_verdict.clone())),
    Column("findings", Text(|row| Some(row.findings.join(" ")))),
    Column("views", Whole(|row| whole(row.views?))),
    Column("lens_model", Text(|row| row.lens.as_ref().map(|lens| lens.model.clone()))),
    Column("fx_px", Number(|row| of(row, |lens| lens.f_px[0]))),
    Column("fy_px", Number(|row| of(row, |lens| lens.f_px[1]))),
    Column("cx_px", Number(|row| of(row, |lens| lens.pp_px[0]))),
    Column("cy_px", Number(|row| of(row, |lens| lens.pp_px[1]))),
    Column("fx_sd_px", Number(|row| row.lens.as_ref()?.sigma.map(|sigma| sigma.f_px[0]))),
    Column("fy_sd_px", Number(|row| row.lens.as_ref()?.sigma.map(|sigma| sigma.f_px[1]))),
    Column("cx_sd_px", Number(|row| row.lens.as_ref()?.sigma.map(|sigma| sigma.pp_px[0]))),
    Column("cy_sd_px", Number(|row| row.lens.as_ref()?.sigma.map(|sigma| sigma.pp_px[1]))),
    Column("k1", Number(|row| of(row, |lens| lens.distortion.k1))),
    Column("k2", Number(|row| of(row, |lens| lens.distortion.k2))),
    Column("p1", Number(|row| of(row, |lens| lens.distortion.p1))),
    Column("p2", Number(|row| of(row, |lens| lens.distortion.p2))),
    Column("k3", Number(|row| of(row, |lens| lens.distortion.k3))),
    Column("k4", Number(|row| of(row, |lens| lens.distortion.k4))),
    Column("k5", Number(|row| of(row, |lens| lens.distortion.k5))),
    Column("k6", Number(|row| of(row, |lens| lens.distortion.k6))),
    Column("rms_px", Number(|row| row.lens.as_ref()?.rms_px)),
    Column("decisions", Whole(|row| whole(row.decisions.as_ref()?.count))),
    Column("decisions_different", Whole(|row| whole(row.decisions.as_ref()?.different))),
    Column("check_verdict", Text(|row| row.check.as_ref()?.verdict.clone())),
    Column("check_statistic", Number(|row| row.check.as_ref()?.statistic)),
    Column("file", Text(|row| row.file.clone())),
];

fn of(row: &Row, value: fn(&LensRow) -> f64) -> Option<f64> {
    row.lens.as_ref().map(value)
}

fn whole(count: usize) -> Option<i64> {
    i64::try_from(count).ok()
}

fn created_ms(row: &Row) -> Option<i64> {
    let created: jiff::Timestamp = row.created.as_ref()?.parse().ok()?;
    Some(created.as_millisecond())
}

/// Writes the row of every item of the manifest in `store` to a Parquet file at `path`, sorted by
/// id.
///
/// # Errors
///
/// As [`gather`], or if the file can't be written.
pub fn gather_parquet(
    store: &Store,
    path: &Path,
    overwrite: Overwrite,
) -> anyhow::Result<Gathered> {
    save_streamed(path, overwrite, |out| {
        let schema = Arc::new(parse_message_type(&schema())?);
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut table = Table {
            file: SerializedFileWriter::new(out, schema, Arc::new(properties))?,
            rows: Vec::with_capacity(GROUP),
        };
        let gathered = gather(store, &mut |line| table.add(serde_json::from_str(line)?))?;
        table.end()?;
        Ok(gathered)
    })
}

/// Columns as a Parquet schema.
fn schema() -> String {
    let columns = COLUMNS.iter().map(|Column(name, value)| match value {
        Text(_) => format!("optional binary {name} (STRING);"),
        Number(_) => format!("optional double {name};"),
        Whole(_) => format!("optional int64 {name};"),
        Time(_) => format!("optional int64 {name} (TIMESTAMP(MILLIS,true));"),
    });
    format!("message boresight_batch_row {{ {} }}", columns.collect::<Vec<_>>().join(" "))
}

struct Table<'a, 'b> {
    file: SerializedFileWriter<&'a mut FileStream<'b>>,
    rows: Vec<Row>,
}

impl Table<'_, '_> {
    fn add(&mut self, row: Row) -> anyhow::Result<()> {
        self.rows.push(row);
        if self.rows.len() < GROUP { Ok(()) } else { self.write() }
    }

    /// Writes the rows so far.
    fn write(&mut self) -> anyhow::Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let mut group = self.file.next_row_group()?;
        for Column(_, value) in COLUMNS {
            let rows = self.rows.iter();
            match value {
                Text(of) => add_column::<ByteArrayType>(
                    &mut group,
                    rows.map(|row| of(row).map(|text| ByteArray::from(text.into_bytes()))),
                )?,
                Number(of) => add_column::<DoubleType>(&mut group, rows.map(of))?,
                Whole(of) | Time(of) => add_column::<Int64Type>(&mut group, rows.map(of))?,
            }
        }
        group.close()?;
        self.rows.clear();
        Ok(())
    }

    fn end(mut self) -> anyhow::Result<()> {
        self.write()?;
        self.file.close()?;
        Ok(())
    }
}

/// Adds the next column: definition levels and values.
fn add_column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, &mut FileStream<'_>>,
    values: impl Iterator<Item = Option<T::T>>,
) -> anyhow::Result<()> {
    let (mut there, mut all) = (Vec::new(), Vec::new());
    for value in values {
        there.push(i16::from(value.is_some()));
        all.extend(value);
    }
    let column = group.next_column()?;
    let mut column = column.ok_or_else(|| anyhow::anyhow!("the table has too few columns"))?;
    column.typed::<T>().write_batch(&all, Some(&there), None)?;
    column.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn columns_have_different_names_that_parquet_takes() {
        let names: BTreeSet<_> = COLUMNS.iter().map(|Column(name, _)| name).collect();
        assert_eq!(names.len(), COLUMNS.len());
        assert!(parse_message_type(&schema()).is_ok());
    }
}

//! Metadata read back by a crate that shares no code with what wrote them.

use std::io::Cursor;

use ::exif::experimental::Writer;
use ::exif::{Context, Field, In, Rational, Reader, Tag, Value};

use crate::publish::picture::{Format, Picture};

const FORMATS: [Format; 3] = [Format::Jpeg, Format::Png, Format::Tiff];

fn picture() -> Picture {
    Picture::from_fn(24, 16, |x, y| {
        [x * 10, y * 15, 40].map(|v| u8::try_from(v).unwrap())
    })
    .unwrap()
}

fn text(words: &str) -> Value {
    Value::Ascii(vec![words.as_bytes().to_vec()])
}

fn fractions(values: &[(u32, u32)]) -> Value {
    let fraction = |&(num, denom): &(u32, u32)| Rational { num, denom };
    Value::Rational(values.iter().map(fraction).collect())
}

/// What a rover's camera says, one field of each kind of value and of each directory.
fn fields() -> Vec<Field> {
    let undefined = |bytes: &[u8]| Value::Undefined(bytes.to_vec(), 0);
    let fields = [
        (Tag::ImageDescription, text("Sol 12, mast camera")),
        (Tag::Make, text("MSSS")),
        (Tag::Model, text("ML")), // Short enough to stand in its entry.
        (Tag::Orientation, Value::Short(vec![6])),
        (Tag::XResolution, fractions(&[(300, 1)])),
        (Tag::YResolution, fractions(&[(301, 1)])),
        (Tag::ResolutionUnit, Value::Short(vec![2])),
        (Tag::DateTime, text("2026:11:22 08:15:30")),
        (Tag::Copyright, text("nobody")),
        (Tag::ExposureTime, fractions(&[(1, 200)])),
        (Tag::PhotographicSensitivity, Value::Short(vec![100, 200])),
        (Tag::ExifVersion, undefined(b"0231")),
        (Tag::SubSecTimeOriginal, text("123")),
        (
            Tag::ExposureBiasValue,
            Value::SRational(vec![::exif::SRational { num: -1, denom: 3 }]),
        ),
        (Tag::PixelXDimension, Value::Long(vec![70_000])),
        (Tag::MakerNote, undefined(&[7; 301])),
        (Tag::GPSVersionID, Value::Byte(vec![2, 3, 0, 0])),
        (Tag::GPSLatitudeRef, text("S")),
        (
            Tag::GPSLatitude,
            fractions(&[(4, 1), (35, 1), (2_268, 100)]),
        ),
        (Tag::GPSAltitude, fractions(&[(4_501, 1)])),
        (Tag::InteroperabilityIndex, text("R98")),
    ];
    let field = |(tag, value)| Field {
        tag,
        ifd_num: In::PRIMARY,
        value,
    };
    fields.into_iter().map(field).collect()
}

/// An EXIF block of the fields, or a TIFF file of one grey strip.
fn block(fields: &[Field], is_little: bool, strip: Option<&[u8]>) -> Vec<u8> {
    let layout = [
        (Tag::ImageWidth, 24),
        (Tag::ImageLength, 16),
        (Tag::BitsPerSample, 8),
        (Tag::Compression, 1),
        (Tag::PhotometricInterpretation, 1),
        (Tag::SamplesPerPixel, 1),
        (Tag::RowsPerStrip, 16),
    ];
    let layout = layout.map(|(tag, value)| Field {
        tag,
        ifd_num: In::PRIMARY,
        value: Value::Short(vec![value]),
    });
    let strips: Vec<&[u8]> = strip.into_iter().collect();
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    if strip.is_some() {
        layout.iter().for_each(|field| writer.push_field(field));
        writer.set_strips(&strips, In::PRIMARY);
    }
    let mut bytes = Cursor::new(Vec::new());
    writer.write(&mut bytes, is_little).unwrap();
    bytes.into_inner()
}

/// What a picture file says of itself, as words, without how its pixels are stored.
fn said(file: &[u8]) -> Vec<String> {
    let read = Reader::new().read_from_container(&mut Cursor::new(file));
    let Ok(read) = read else {
        return Vec::new();
    };
    let storage = [
        254, 256, 257, 258, 259, 262, 273, 277, 278, 279, 284, 317, 339, 700, 34_675,
    ];
    let is_storage =
        |f: &Field| f.tag.context() == Context::Tiff && storage.contains(&f.tag.number());
    let mut said: Vec<String> = read
        .fields()
        .filter(|f| !is_storage(f))
        .map(|f| format!("{} {} {:?}", f.ifd_num, f.tag, f.value))
        // Undefined bytes come with their place in the file.
        .map(|words| words.split(", ofs=").next().unwrap_or_default().to_owned())
        .collect();
    said.sort();
    said
}

#[test]
fn exif_survives_from_every_format_to_every_other() {
    let fields = fields();
    let expected = said(&block(&fields, true, None));
    assert_eq!(expected.len(), fields.len());
    for is_little in [true, false] {
        let grey = block(&fields, is_little, Some(&[90; 24 * 16]));
        let mut source = picture();
        source.metadata.exif = Some(block(&fields, is_little, None));
        let sources = [
            source.to_jpeg(90).unwrap(),
            source.to_png().unwrap(),
            grey,
            source.encode(Format::Tiff, 90).unwrap(),
        ];
        for (index, file) in sources.iter().enumerate() {
            assert_eq!(said(file), expected, "{index}");
            for format in FORMATS {
                let copy = Picture::decode(file).unwrap().encode(format, 90).unwrap();
                assert_eq!(said(&copy), expected, "{index} to {format}");
                let again = Picture::decode(&copy).unwrap();
                assert_eq!((again.width(), again.height()), (24, 16));
                let again = again.encode(Format::Tiff, 90).unwrap();
                assert_eq!(said(&again), expected, "{index} to {format} to TIFF");
            }
        }
    }
}

/// A profile's header names its channels at byte 16.
fn profile(channels: &[u8; 4], length: usize) -> Vec<u8> {
    let mut profile: Vec<u8> = (0..length).map(|i| i.to_le_bytes()[0]).collect();
    profile[16..20].copy_from_slice(channels);
    profile
}

#[test]
fn xmp_and_the_colour_profile_survive_from_every_format_to_every_other() {
    let mut source = picture();
    source.metadata.xmp = Some("<x:xmpmeta>Grüße</x:xmpmeta>".as_bytes().to_vec());
    // Longer than one segment of a JPEG.
    source.metadata.icc = Some(profile(b"RGB ", 150_000));
    for from in FORMATS {
        let file = source.encode(from, 90).unwrap();
        let read = Picture::decode(&file).unwrap();
        assert_eq!(read.metadata, source.metadata, "{from}");
        for to in FORMATS {
            let copy = Picture::decode(&read.encode(to, 90).unwrap()).unwrap();
            assert_eq!(copy.metadata, source.metadata, "{from} to {to}");
        }
    }
    // By other readers: that of the image crate, and that of the tiff crate.
    let png = source.to_png().unwrap();
    let mut decoder = image::codecs::png::PngDecoder::new(Cursor::new(png)).unwrap();
    use image::ImageDecoder as _;
    assert_eq!(decoder.icc_profile().unwrap(), source.metadata.icc);
    assert_eq!(decoder.xmp_metadata().unwrap(), source.metadata.xmp);
    let file = source.encode(Format::Tiff, 90).unwrap();
    let mut decoder = image::codecs::tiff::TiffDecoder::new(Cursor::new(file)).unwrap();
    assert_eq!(decoder.icc_profile().unwrap(), source.metadata.icc);
    assert_eq!(decoder.xmp_metadata().unwrap(), source.metadata.xmp);
}

#[test]
fn a_profile_of_other_channels_is_not_carried_to_a_picture_in_colour() {
    let read = |profile| super::Metadata::new(None, None, Some(profile)).icc;
    assert_eq!(read(profile(b"GRAY", 200)), None);
    assert_eq!(read(profile(b"CMYK", 200)), None);
    assert_eq!(read(vec![0; 12]), None);
    let rgb = profile(b"RGB ", 200);
    assert_eq!(read(rgb.clone()), Some(rgb));
}

#[test]
fn exif_too_long_for_a_jpeg_loses_the_makers_note_alone() {
    let mut fields = fields();
    let note = fields.iter_mut().find(|f| f.tag == Tag::MakerNote).unwrap();
    note.value = Value::Undefined(vec![1; 70_000], 0);
    let tiff = block(&fields, false, Some(&[90; 24 * 16]));
    let read = Picture::decode(&tiff).unwrap();
    assert_eq!(said(&read.encode(Format::Png, 90).unwrap()), said(&tiff));
    fields.retain(|f| f.tag != Tag::MakerNote);
    let expected = said(&block(&fields, true, None));
    assert_eq!(said(&read.to_jpeg(90).unwrap()), expected);
}

#[test]
fn damaged_metadata_cost_no_picture() {
    let whole = block(&fields(), false, None);
    let mut state = 7_u32;
    for _ in 0..2_000 {
        let mut damaged = whole.clone();
        for _ in 0..4 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let at = (state >> 8) as usize % damaged.len();
            damaged[at] = state.to_be_bytes()[0];
        }
        damaged.truncate(damaged.len() - (state >> 4) as usize % 40);
        let mut picture = picture();
        picture.metadata.exif = Some(damaged);
        for format in FORMATS {
            let copy = picture.encode(format, 90).unwrap();
            assert_eq!(Picture::decode(&copy).unwrap().width(), 24);
        }
    }
}

#[test]
fn a_tiff_that_says_nothing_has_no_metadata() {
    let file = picture().encode(Format::Tiff, 90).unwrap();
    assert_eq!(Picture::decode(&file).unwrap(), picture());
    let big = [b"II\x2b\0\x08\0\0\0".as_slice(), &[255; 40]].concat();
    assert_eq!(super::Metadata::of_tiff(&big), super::Metadata::default());
}

/// The same directory in the layout of `BigTIFF`, whose counts and places take eight bytes.
#[test]
fn big_tiff_is_read_alike() {
    let mut file = b"MM\0\x2b\0\x08\0\0\0\0\0\0\0\0\0\x10".to_vec();
    let entry = |tag: u16, kind: u16, count: u64, value: [u8; 8]| {
        let (tag, kind) = (tag.to_be_bytes(), kind.to_be_bytes());
        [&tag, &kind, count.to_be_bytes().as_slice(), &value].concat()
    };
    file.extend(2_u64.to_be_bytes());
    file.extend(entry(271, 2, 8, *b"Malin S\0"));
    file.extend(entry(272, 2, 10, 72_u64.to_be_bytes()));
    file.extend(0_u64.to_be_bytes());
    assert_eq!(file.len(), 72);
    file.extend(b"Mastcam R\0");
    let block = super::Metadata::of_tiff(&file).exif.unwrap();
    let read = Reader::new().read_raw(block).unwrap();
    let words = |tag| {
        read.get_field(tag, In::PRIMARY)
            .unwrap()
            .display_value()
            .to_string()
    };
    assert_eq!(words(Tag::Make), "\"Malin S\"");
    assert_eq!(words(Tag::Model), "\"Mastcam R\"");
}

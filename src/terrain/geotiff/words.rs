//! The keys of a GeoTIFF by their names, each with a text, as labels of VICAR images hold them.

use super::keys::{GeoKeys, KeyFault, RASTER_TYPE};
use super::place::crs_from_post;
use super::projection;
use crate::terrain::{Affine, HeightsAbove};

/// Names of the keys (7.2 to 7.4 and annex D of the standard, and of its first version), with their numbers.
const NAMES: [(&str, u16); 47] = [
    ("GTMODELTYPEGEOKEY", 1024),
    ("GTRASTERTYPEGEOKEY", 1025),
    ("GTCITATIONGEOKEY", 1026),
    ("GEOGRAPHICTYPEGEOKEY", 2048),
    ("GEOGCITATIONGEOKEY", 2049),
    ("GEOGGEODETICDATUMGEOKEY", 2050),
    ("GEOGPRIMEMERIDIANGEOKEY", 2051),
    ("GEOGLINEARUNITSGEOKEY", 2052),
    ("GEOGANGULARUNITSGEOKEY", 2054),
    ("GEOGELLIPSOIDGEOKEY", 2056),
    ("GEOGSEMIMAJORAXISGEOKEY", 2057),
    ("GEOGSEMIMINORAXISGEOKEY", 2058),
    ("GEOGINVFLATTENINGGEOKEY", 2059),
    ("GEOGPRIMEMERIDIANLONGGEOKEY", 2061),
    ("PROJECTEDCSTYPEGEOKEY", 3072),
    ("PCSCITATIONGEOKEY", 3073),
    ("PROJECTIONGEOKEY", 3074),
    ("PROJCOORDTRANSGEOKEY", 3075),
    ("PROJLINEARUNITSGEOKEY", 3076),
    ("PROJLINEARUNITSIZEGEOKEY", 3077),
    ("PROJSTDPARALLEL1GEOKEY", 3078),
    ("PROJSTDPARALLELGEOKEY", 3078),
    ("PROJSTDPARALLEL2GEOKEY", 3079),
    ("PROJNATORIGINLONGGEOKEY", 3080),
    ("PROJORIGINLONGGEOKEY", 3080),
    ("PROJNATORIGINLATGEOKEY", 3081),
    ("PROJORIGINLATGEOKEY", 3081),
    ("PROJFALSEEASTINGGEOKEY", 3082),
    ("PROJFALSENORTHINGGEOKEY", 3083),
    ("PROJFALSEORIGINLONGGEOKEY", 3084),
    ("PROJFALSEORIGINLATGEOKEY", 3085),
    ("PROJFALSEORIGINEASTINGGEOKEY", 3086),
    ("PROJFALSEORIGINNORTHINGGEOKEY", 3087),
    ("PROJCENTERLONGGEOKEY", 3088),
    ("PROJCENTERLATGEOKEY", 3089),
    ("PROJCENTEREASTINGGEOKEY", 3090),
    ("PROJCENTERNORTHINGGEOKEY", 3091),
    ("PROJSCALEATNATORIGINGEOKEY", 3092),
    ("PROJSCALEATORIGINGEOKEY", 3092),
    ("PROJSCALEATCENTERGEOKEY", 3093),
    ("PROJAZIMUTHANGLEGEOKEY", 3094),
    ("PROJSTRAIGHTVERTPOLELONGGEOKEY", 3095),
    ("VERTICALCSTYPEGEOKEY", 4096),
    ("VERTICALCITATIONGEOKEY", 4097),
    ("VERTICALDATUMGEOKEY", 4098),
    ("VERTICALUNITSGEOKEY", 4099),
    ("PROJCSTYPEGEOKEY", 3072),
];

/// What the keys and tags of a GeoTIFF say of a raster.
pub(in crate::terrain) struct Georeference {
    /// The coordinate reference system, as PROJ understands it.
    pub crs: String,
    /// Where the posts stand in it.
    pub crs_from_post: Affine,
    /// What heights are above.
    pub above: HeightsAbove,
    /// Metres in the unit of heights.
    pub unit_m: f64,
}

/// Reads keys and tags from their texts, `1(ModelTypeProjected)`; `value` has those of a name in capital
/// letters.
///
/// # Errors
/// The name that does not serve, and how.
pub(in crate::terrain) fn georeference(
    value: &dyn Fn(&str) -> Option<String>,
) -> Result<Georeference, (&'static str, String)> {
    let told = |fault: KeyFault| (fault.key, fault.problem);
    let named = NAMES.iter().filter_map(|(name, key)| {
        let text = value(name)?;
        Some((*key, text))
    });
    let keys = GeoKeys::of_texts(named);
    let numbers = |name: &'static str| -> Result<Vec<f64>, (&'static str, String)> {
        let Some(text) = value(name) else {
            return Ok(Vec::new());
        };
        let inner = text.trim().trim_matches(['(', ')']);
        let numbers = inner.split(',').map(|part| part.trim().parse::<f64>());
        numbers
            .collect::<Result<_, _>>()
            .map_err(|_| (name, format!("found {text:?}, expected numbers")))
    };
    let is_point = keys.code(RASTER_TYPE) == Some(2);
    let [matrix, tie, scale] = [
        numbers("MODELTRANSFORMATIONTAG")?,
        numbers("MODELTIEPOINTTAG")?,
        numbers("MODELPIXELSCALETAG")?,
    ];
    Ok(Georeference {
        crs: projection::crs(&keys).map_err(told)?,
        crs_from_post: crs_from_post(&matrix, &tie, &scale, is_point).map_err(told)?,
        above: keys.heights_above(),
        unit_m: keys.vertical_unit_m().map_err(told)?,
    })
}

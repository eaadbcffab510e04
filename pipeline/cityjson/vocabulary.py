"""The words that CityJSON 2.0 allows: types of objects, surfaces and geometries, levels, addresses."""

from __future__ import annotations

import re

_OBJECTS = """
Bridge BridgeConstructiveElement BridgeFurniture BridgeInstallation BridgePart BridgeRoom Building
BuildingConstructiveElement BuildingFurniture BuildingInstallation BuildingPart BuildingRoom
BuildingStorey BuildingUnit CityFurniture CityObjectGroup GenericCityObject LandUse OtherConstruction
PlantCover Railway Road SolitaryVegetationObject TINRelief TransportSquare Tunnel
TunnelConstructiveElement TunnelFurniture TunnelHollowSpace TunnelInstallation TunnelPart WaterBody
Waterway
"""

_SURFACES = """
RoofSurface GroundSurface WallSurface ClosureSurface OuterCeilingSurface OuterFloorSurface Window Door
InteriorWallSurface CeilingSurface FloorSurface WaterSurface WaterGroundSurface WaterClosureSurface
TrafficArea AuxiliaryTrafficArea TransportationMarking TransportationHole
"""

OBJECT_TYPES = frozenset(_OBJECTS.split())
"""Types of city objects; an extension's begin with ``+``."""

SURFACE_TYPES = frozenset(_SURFACES.split())
"""Types of semantic surfaces; an extension's begin with ``+``."""

DEPTH = {
    "MultiPoint": 1,
    "MultiLineString": 2,
    "MultiSurface": 3,
    "CompositeSurface": 3,
    "Solid": 4,
    "MultiSolid": 5,
    "CompositeSolid": 5,
    "GeometryInstance": 1,
}
"""How deep the boundaries of each type of geometry are nested."""

LOD = re.compile(r"[0-3](\.[0-3])?")
"""Levels of detail, always as strings."""

CRS = re.compile(r"https?://www\.opengis\.net/def/crs/[^/:\s]+/[^/:\s]+/[^/:\s]+")
"""Reference systems, as addresses of the OGC."""

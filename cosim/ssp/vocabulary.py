"""Names of the standard (SSP 1.0; 2.0 has the same namespaces), and those of two masters that run our packages."""

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SSM = "http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
SSB = "http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"
OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"
OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"
HFSA = "urn:hfsa:ssp:scene"

MAIN = "SystemStructure.ssd"
"""Name of the system structure description in the archive."""

OURS, OPEN_SIMULATION_PLATFORM, OPEN_MODELICA = "org.hfsa.scene", "com.opensimulationplatform", "org.openmodelica"
"""Types of the annotations that are read."""

OFFERED = "org.hfsa.offered"
"""Type of the annotation with the inputs and outputs of a scene, which our own has too."""

FMU_TYPE, STRUCTURE_TYPE, PACKAGE_TYPE = (
    "application/x-fmu-sharedlibrary",
    "application/x-ssp-definition",
    "application/x-ssp-package",
)
"""Types of a component: an FMU, the default, a description beside this one, and a package."""

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Exponents of a base unit, in the order of `Connector.base_unit`, before its factor and offset."""

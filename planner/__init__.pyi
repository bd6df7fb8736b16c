"""The public names of the package, each from the module it is declared in: the one list of them."""

from planner.autopilot import Autopilot as Autopilot
from planner.autopilot import Target as Target
from planner.errors import MavjouleError as MavjouleError
from planner.findings import Finding as Finding
from planner.findings import Place as Place
from planner.findings import Severity as Severity
from planner.fleet.fleet import Fleet as Fleet
from planner.fleet.reader import read_fleet as read_fleet
from planner.logs.csv import CsvMapping as CsvMapping
from planner.logs.csv import read_csv_mapping as read_csv_mapping
from planner.logs.files import read_log as read_log
from planner.logs.record import FlightRecord as FlightRecord
from planner.mission.convert import mission_at_speed as mission_at_speed
from planner.mission.files import read_mission as read_mission
from planner.mission.files import write_mission as write_mission
from planner.mission.items import Mission as Mission
from planner.physics.wind import Wind as Wind
from planner.quantity import Spread as Spread
from planner.report.fleet_exports import write_exports as write_exports
from planner.selection import Selection as Selection
from planner.service.comparison import Comparison as Comparison
from planner.service.comparison import compare_results as compare_results
from planner.service.fleet import FleetResult as FleetResult
from planner.service.fleet import check_fleet as check_fleet
from planner.service.fleet_contingency import Contingency as Contingency
from planner.service.fleet_plan import FleetPlan as FleetPlan
from planner.service.fleet_plan import plan_fleet as plan_fleet
from planner.service.fleet_plan import write_plan as write_plan
from planner.service.fleet_volumes import fleet_volumes as fleet_volumes
from planner.service.preflight import CheckResult as CheckResult
from planner.service.preflight import check as check
from planner.service.separation import check_together as check_together
from planner.service.speed import SpeedCurve as SpeedCurve
from planner.service.speed import predict_speed_curve as predict_speed_curve
from planner.service.split import Split as Split
from planner.service.split import split_mission as split_mission
from planner.service.split import write_split as write_split
from planner.setup import Reserve as Reserve
from planner.setup import Setup as Setup
from planner.site_profile import read_profile as read_profile
from planner.vehicle.battery import Battery as Battery
from planner.vehicle.library import load_vehicle as load_vehicle
from planner.vehicle.model import VehicleModel as VehicleModel

__version__: str

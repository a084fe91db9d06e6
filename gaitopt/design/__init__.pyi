from gaitopt.design.family import Family as Family
from gaitopt.design.family_gaits import FamilyGaits as FamilyGaits
from gaitopt.design.planned_law import planned_gains as planned_gains
from gaitopt.design.planned_law import planned_law as planned_law

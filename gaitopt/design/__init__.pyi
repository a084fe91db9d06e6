from gaitopt.design.family import Family as Family
from gaitopt.design.family_gaits import FamilyGaits as FamilyGaits

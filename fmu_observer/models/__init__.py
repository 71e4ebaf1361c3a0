"""What an observer believes of its plant: equations, signals, constants. No observer and no gain lives here."""

from fmu_observer.models.braked_train import braked_train
from fmu_observer.models.cart_double_pendulum import cart_double_pendulum
from fmu_observer.models.cart_pendulum import cart_pendulum
from fmu_observer.models.coupled_vehicles import coupled_vehicles
from fmu_observer.models.flexible_joint_arm import flexible_joint_arm, flexible_joint_arm_as_printed
from fmu_observer.models.freight_train import freight_train
from fmu_observer.models.linear_pendulum import linear_pendulum
from fmu_observer.models.model import ObserverModel
from fmu_observer.models.networked_train import networked_train
from fmu_observer.models.pendulum import pendulum
from fmu_observer.models.registry import MODELS, find_model
from fmu_observer.models.sector_nonlinearity import sector_nonlinearity
from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.models.state_affine_registry import STATE_AFFINE_MODELS, find_state_affine_model
from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel
from fmu_observer.models.takagi_sugeno_registry import TAKAGI_SUGENO_MODELS, find_takagi_sugeno_model
from fmu_observer.models.tanh_system import tanh_system

__all__ = [
    "MODELS",
    "STATE_AFFINE_MODELS",
    "TAKAGI_SUGENO_MODELS",
    "ObserverModel",
    "Premise",
    "StateAffineModel",
    "TakagiSugenoModel",
    "braked_train",
    "cart_double_pendulum",
    "cart_pendulum",
    "coupled_vehicles",
    "find_model",
    "find_state_affine_model",
    "find_takagi_sugeno_model",
    "flexible_joint_arm",
    "flexible_joint_arm_as_printed",
    "freight_train",
    "linear_pendulum",
    "networked_train",
    "pendulum",
    "sector_nonlinearity",
    "tanh_system",
]

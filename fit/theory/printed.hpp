#pragma once

// Numbers exactly as Quinn and Hong (2000) print them, for the audit and for the readings that use the printed
// constants. No computation of the library starts from them. [QuinnHong2000]
namespace shakebed::fit::printed {

inline constexpr double mu_0 = 111.52274;                 // text after eq. (4), at phi_0 = 2/sqrt 3
inline constexpr double lambda_1 = 5503.531806;           // text after eq. (5)
inline constexpr double critical_temperature_mm = 0.607;  // T_c/mg, for D = 2.99 mm and mu = 10.2
inline constexpr double temperature_mm = 0.36;            // T/mg of the fit
inline constexpr double reduced_temperature = 0.593;      // T/T_c
inline constexpr double solid_height = 4.15;              // zeta_F, in layers
inline constexpr double shift_mm = 12.0;                  // z_o
inline constexpr double shift_times_plateau = 4.41;       // phi_0 zeta_0
inline constexpr double diameter_mm = 2.99;               // D
inline constexpr double initial_height = 10.2;            // mu
inline constexpr double plateau_density = 1.10;           // of the experiment's profile
inline constexpr double map_reduced_temperature = 0.663;  // T/T_c from eq. (6)

}  // namespace shakebed::fit::printed

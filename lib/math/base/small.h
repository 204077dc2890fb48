/* The parts of the library that a build has.
 *
 * A library for trees alone (-Dloops=disabled, KT_NO_LOOPS) has no closed loops. A small library (-Dsmall=enabled,
 * KT_SMALL) leaves out the parts of this table, too. A description or a call that needs one of them is rejected with a
 * message. The public headers mark the functions that a small library lacks.
 *
 *   implicit and linearly implicit methods, Jacobians of mechanisms and effects    KT_HAS_JACOBIAN, KT_HAS_ROSENBROCK
 *   formulas, bumps, sums and products of functions, auxiliary states, polygons    KT_HAS_FORMULAS
 *   events                                                                         KT_HAS_EVENTS
 *   loops and effects that can be switched, hard contacts, friction that sticks    KT_HAS_SWITCHES
 *   effects in relative coordinates of loops                                       KT_HAS_RELATIVE
 *   masses that are functions of time                                              KT_HAS_VARIABLE_MASS
 *   coordinates that move no mass                                                  KT_HAS_QUASI_STATICS
 *   slopes at the ends of cubic tables                                             KT_HAS_END_SLOPES
 *
 * Two more parts save time and change results by rounding only, so that nothing is rejected:
 *
 *   recursions in the plane; without them all trees have the bits of KT_PLAN_SPATIAL    KT_HAS_PLANE
 *   bounds of speeds between gaps; without them gaps are evaluated at each step         KT_HAS_CLEARANCES
 *
 * The macros are 0 or 1, for #if and for conditions that the compiler removes.
 */
#ifndef KT_BASE_SMALL_H
#define KT_BASE_SMALL_H

#ifdef KT_SMALL
#define KT_IS_FULL 0
#else
#define KT_IS_FULL 1
#endif

/* The message for parts that are left out. */
#define KT_NOT_IN_SMALL "a small library (-Dsmall=enabled) does not have this"

#ifdef KT_NO_LOOPS
#define KT_HAS_LOOPS 0
#else
#define KT_HAS_LOOPS 1
#endif

#define KT_HAS_JACOBIAN KT_IS_FULL
#define KT_HAS_ROSENBROCK KT_IS_FULL
#define KT_HAS_FORMULAS KT_IS_FULL
#define KT_HAS_EVENTS KT_IS_FULL
#define KT_HAS_SWITCHES KT_IS_FULL
#define KT_HAS_RELATIVE (KT_IS_FULL && KT_HAS_LOOPS)
#define KT_HAS_VARIABLE_MASS KT_IS_FULL
#define KT_HAS_QUASI_STATICS KT_IS_FULL
#define KT_HAS_END_SLOPES KT_IS_FULL
#define KT_HAS_PLANE KT_IS_FULL
#define KT_HAS_CLEARANCES KT_IS_FULL

#endif

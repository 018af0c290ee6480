"""Two right BSDFs, and variations that are each wrong in one way."""

import drjit as dr
import mitsuba as mi


def lambertian():
    """Return the class of a Lambertian BSDF for the active variant: classes of Mitsuba belong to one variant."""

    class Lambertian(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.reflectance = props.get_texture("reflectance", 0.5)
            self.m_flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
            self.m_components = [self.m_flags]

        def traverse(self, callback):
            callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

        def albedo(self, si):
            return self.reflectance.eval(si)

        def density(self, wi, wo):
            return dr.maximum(wo.z, 0) * dr.inv_pi

        def draw(self, wi, sample2):
            return mi.warp.square_to_cosine_hemisphere(sample2)

        def value(self, si, wo):
            return self.albedo(si) * dr.inv_pi * dr.maximum(wo.z, 0)

        def weight(self, si, wo, pdf):
            return self.value(si, wo) / dr.maximum(pdf, 1e-20)

        def eval(self, ctx, si, wo, active=True):
            return mi.depolarizer(dr.select((si.wi.z > 0) & (wo.z > 0), self.value(si, wo), 0))

        def pdf(self, ctx, si, wo, active=True):
            return dr.select((si.wi.z > 0) & (wo.z > 0), self.density(si.wi, wo), 0)

        def sample(self, ctx, si, sample1, sample2, active=True):
            bs = dr.zeros(mi.BSDFSample3f, dr.width(sample1))
            bs.wo = self.draw(si.wi, sample2)
            bs.pdf = self.pdf(ctx, si, bs.wo)
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
            weight = dr.select(bs.pdf > 0, self.weight(si, bs.wo, bs.pdf), 0)
            return bs, mi.depolarizer(weight)

    return Lambertian


def models():
    """Return the classes by plugin name."""
    Lambertian = lambertian()

    class HalfVector(Lambertian):
        """A quarter of Lambert, sampled by reflection about cosine-distributed half vectors."""

        def value(self, si, wo):
            return super().value(si, wo) / 4

        def density(self, wi, wo):
            m = dr.normalize(wi + wo)
            return m.z * dr.inv_pi / (4 * dr.dot(wo, m))

        def draw(self, wi, sample2):
            return mi.reflect(wi, mi.Normal3f(mi.warp.square_to_cosine_hemisphere(sample2)))

    class MissingJacobian(HalfVector):
        def density(self, wi, wo):
            return dr.normalize(wi + wo).z * dr.inv_pi

    class MissingCosine(Lambertian):
        def value(self, si, wo):
            return self.albedo(si) * dr.inv_pi

        def weight(self, si, wo, pdf):
            return self.albedo(si)

    class NonReciprocal(Lambertian):
        def albedo(self, si):
            return super().albedo(si) * (0.5 + 0.5 * si.wi.z)

    class WrongWeight(Lambertian):
        def weight(self, si, wo, pdf):
            return 0.9 * self.albedo(si)

    class Flickering(Lambertian):
        calls = 0

        def albedo(self, si):
            self.calls += 1
            return super().albedo(si) * (1 + 1e-6 * (self.calls % 5))

    class Creating(Lambertian):
        """Reflects 1.25 times what it receives."""

        def albedo(self, si):
            return super().albedo(si) * 2.5

    class NaNAtGrazing(Lambertian):
        def eval(self, ctx, si, wo, active=True):
            return super().eval(ctx, si, wo) * (si.wi.z / si.wi.z)

    class InfiniteGradient(Lambertian):
        """Right in value, but at a reflectance of 0.5 the root's derivative is infinite."""

        def albedo(self, si):
            return super().albedo(si) * (1 + dr.sqrt(dr.maximum(super().albedo(si) - 0.5, 0)))

    class DimAtNormal(Lambertian):
        """A fifth as bright where one direction is exactly normal, both ways round: random directions never are."""

        def value(self, si, wo):
            normal = (si.wi.z == 1) | (wo.z == 1)
            return super().value(si, wo) * dr.select(normal, 0.2, 1)

    class DimFromNormal(Lambertian):
        """The same one way only."""

        def value(self, si, wo):
            return super().value(si, wo) * dr.select(si.wi.z == 1, 0.2, 1)

    class SpikeInRetroPdf(Lambertian):
        def density(self, wi, wo):
            return super().density(wi, wo) * dr.select(dr.all(wi == wo), 3, 1)

    class NaNWithoutReflectance(Lambertian):
        def albedo(self, si):
            reflectance = super().albedo(si)
            return reflectance * (reflectance / reflectance)

    class DeadWhenWhite(Lambertian):
        """Right in value, but at 1 the derivative of the limit is 0."""

        def albedo(self, si):
            return dr.clip(super().albedo(si), 0, 1)

    class NegativeWhenSmooth(Lambertian):
        """With a parameter that is no reflectance, but tells its range."""

        def __init__(self, props):
            super().__init__(props)
            self.roughness = props.get_texture("roughness", 0.5)

        def traverse(self, callback):
            super().traverse(callback)
            callback.put("roughness", self.roughness, mi.ParamFlags.Differentiable)

        def ranges(self):
            return {"roughness": (0.1, 0.9)}

        def albedo(self, si):
            return super().albedo(si) * (self.roughness.eval(si) - 0.2)

    class ClosureInALoop(Lambertian):
        """Right if called directly; in virtual calls Dr.Jit drops the derivative of what a loop's body captures."""

        def albedo(self, si):
            quarter = super().albedo(si) / 4
            start = mi.UInt32(0), dr.zeros(type(quarter))
            return dr.while_loop(start, lambda k, _: k < 4, lambda k, total: (k + 1, total + quarter))[1]

    class NaNPdf(Lambertian):
        def density(self, wi, wo):
            return super().density(wi, wo) / dr.select(wo.z < 0.1, dr.nan, 1.0)

    class Detached(Lambertian):
        def albedo(self, si):
            return dr.detach(super().albedo(si))

    class UnsetEta(Lambertian):
        def sample(self, ctx, si, sample1, sample2, active=True):
            bs, weight = super().sample(ctx, si, sample1, sample2)
            bs.eta = 0.0
            return bs, weight

    class WrongSampledPdf(Lambertian):
        def sample(self, ctx, si, sample1, sample2, active=True):
            bs, weight = super().sample(ctx, si, sample1, sample2)
            bs.pdf *= 1.1
            return bs, weight

    class WrongEvalPdf(Lambertian):
        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo), 0.5 * self.pdf(ctx, si, wo)

    class Raising(Lambertian):
        def pdf(self, ctx, si, wo, active=True):
            raise NotImplementedError("no density yet")

    class VectorOnly(Lambertian):
        """Asks for the shape of an array, which scalar variants do not have."""

        def albedo(self, si):
            return super().albedo(si) * (si.wi.z.shape[0] / si.wi.z.shape[0])

    local = dict(locals())
    return {name: kind for name, kind in local.items() if isinstance(kind, type)}


def register(*_):
    """Register the models in the active variant."""
    for name, kind in models().items():
        mi.register_bsdf(f"broken_{name}", lambda props, kind=kind: kind(props))
